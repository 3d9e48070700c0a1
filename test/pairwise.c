/* pairwise.c -- see pairwise.h. Cohen, Dalal, Fredman & Patton 1997, "The AETG system", without its random choices. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "pairwise.h"

static int met(const pairwise *p, int a, int x, int b, int y) {
    for (int i = 0; i < p->count; i++)
        if (p->rows[i][a] == x && p->rows[i][b] == y)
            return 1;
    return 0;
}

/* What the value x of parameter a would meet for the first time among those `chosen`. */
static int gain(const pairwise *p, const unsigned char *row, const char *chosen, int a, int x) {
    int sum = 0;
    for (int b = 0; b < p->parameters; b++)
        sum += chosen[b] && b != a && !met(p, a, x, b, row[b]);
    return sum;
}

static int first_missing(const pairwise *p, int out[4]) {
    for (int a = 0; a < p->parameters; a++)
        for (int b = a + 1; b < p->parameters; b++)
            for (int x = 0; x < p->levels[a]; x++)
                for (int y = 0; y < p->levels[b]; y++)
                    if (!met(p, a, x, b, y)) {
                        int found[4] = {a, x, b, y};
                        memcpy(out, found, sizeof found);
                        return 1;
                    }
    return 0;
}

void pairwise_fill(pairwise *p) {
    int start[4];
    p->count = 0;
    while (first_missing(p, start)) {
        unsigned char row[PAIRWISE_MOST] = {0};
        char chosen[PAIRWISE_MOST] = {0};
        assert_true(p->count < PAIRWISE_ROWS);
        row[start[0]] = (unsigned char)start[1];
        row[start[2]] = (unsigned char)start[3];
        chosen[start[0]] = chosen[start[2]] = 1;
        for (int k = 2; k < p->parameters; k++) {
            int best = -1, best_a = 0, best_x = 0;
            for (int a = 0; a < p->parameters; a++)
                for (int j = 0; !chosen[a] && j < p->levels[a]; j++) {
                    int x = (j + p->count) % p->levels[a], g = gain(p, row, chosen, a, x); /* ties: by turns */
                    if (g > best) {
                        best = g;
                        best_a = a;
                        best_x = x;
                    }
                }
            row[best_a] = (unsigned char)best_x;
            chosen[best_a] = 1;
        }
        memcpy(p->rows[p->count++], row, sizeof row);
    }
}

int pairwise_missing(const pairwise *p) {
    int count = 0;
    for (int a = 0; a < p->parameters; a++)
        for (int b = a + 1; b < p->parameters; b++)
            for (int x = 0; x < p->levels[a]; x++)
                for (int y = 0; y < p->levels[b]; y++)
                    count += !met(p, a, x, b, y);
    return count;
}
