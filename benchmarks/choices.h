/* What the loops in C share: the stream that they draw from, and the greedy choice. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

static inline uint64_t rotate_left(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

/* xoshiro256++ (Blackman and Vigna 2021) */
static inline double uniform(uint64_t s[4]) {
    uint64_t result = rotate_left(s[0] + s[3], 23) + s[0], t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate_left(s[3], 45);
    return (double)(result >> 11) * 0x1.0p-53;
}

static inline int64_t below(int64_t n, uint64_t s[4]) { return (int64_t)(uniform(s) * (double)n); }

static inline double row_max(const double *row, int64_t n) {
    double best = row[0];
    for (int64_t a = 1; a < n; a++)
        if (row[a] > best) best = row[a];
    return best;
}

static inline int64_t maxima(const double *row, int64_t n, int64_t *ties) {
    double best = row_max(row, n);
    int64_t first = 0, count = 0;
    for (int64_t a = n - 1; a >= 0; a--) {
        if (row[a] == best) {
            first = a;
            count++;
        }
    }
    *ties = count;
    return first;
}

static inline int64_t random_maximum(const double *row, int64_t first, int64_t ties, uint64_t s[4]) {
    if (ties == 1) return first;
    int64_t skip = below(ties, s), a = first;
    while (skip > 0)
        if (row[++a] == row[first]) skip--;
    return a;
}

static inline int64_t greedy(const double *row, int64_t n, uint64_t s[4]) {
    int64_t ties, first = maxima(row, n, &ties);
    return random_maximum(row, first, ties, s);
}

static inline int64_t epsilon_greedy(const double *row, int64_t n, double epsilon, uint64_t s[4]) {
    return uniform(s) < epsilon ? below(n, s) : greedy(row, n, s);
}
