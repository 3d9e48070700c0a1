/* pairwise.h -- few combinations of many parameters' values in which every two values of two parameters meet. */
#ifndef PAIRWISE_H
#define PAIRWISE_H

enum { PAIRWISE_MOST = 12, PAIRWISE_ROWS = 256 };

typedef struct pairwise {
    int parameters, levels[PAIRWISE_MOST]; /* how many, and how many values each has */
    int count;
    unsigned char rows[PAIRWISE_ROWS][PAIRWISE_MOST];
} pairwise;

/* Fills rows and count; parameters and levels are given. One row after the other, each beginning with a pair that is
 * missing, every further value chosen to meet the most that it has not met. Fails the test if rows don't suffice. */
void pairwise_fill(pairwise *p);

/* How many pairs are in no row. */
int pairwise_missing(const pairwise *p);

#endif
