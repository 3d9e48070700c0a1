/* mitsuba_spelling.c -- near spellings by edit distance (Damerau 1964: insertion, deletion, substitution, and the swap
 * of neighbours each count one). */
#include "mitsuba_spelling.h"

#include <string.h>

#define MAX_LENGTH 40

static int smaller(int a, int b) { return a < b ? a : b; }

static int lower(char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; }

static int distance(const char *a, int a_length, const char *b, int b_length) {
    int d[MAX_LENGTH + 1][MAX_LENGTH + 1];
    for (int i = 0; i <= a_length; i++) d[i][0] = i;
    for (int j = 0; j <= b_length; j++) d[0][j] = j;
    for (int i = 1; i <= a_length; i++)
        for (int j = 1; j <= b_length; j++) {
            int x = lower(a[i - 1]), y = lower(b[j - 1]);
            int best = d[i - 1][j - 1] + (x != y);
            best = smaller(best, smaller(d[i - 1][j], d[i][j - 1]) + 1);
            if (i > 1 && j > 1 && x == lower(b[j - 2]) && lower(a[i - 2]) == y)
                best = smaller(best, d[i - 2][j - 2] + 1);
            d[i][j] = best;
        }
    return d[a_length][b_length];
}

const char *mitsuba_nearest(const char *word, const char *const *candidates, size_t count) {
    size_t length = strlen(word);
    if (length == 0 || length > MAX_LENGTH) return NULL;
    /* Short words have short slips: "foo" is no misspelling of "hg". */
    int limit = length < 3 ? 1 : length < 8 ? 2 : 3;
    const char *best = NULL;
    for (size_t i = 0; i < count; i++) {
        size_t n = strlen(candidates[i]);
        if (n > MAX_LENGTH) continue;
        int d = distance(word, (int)length, candidates[i], (int)n);
        if (d <= limit && d < (int)n && d < (int)length) {
            best = candidates[i];
            limit = d - 1;
        }
    }
    return best;
}
