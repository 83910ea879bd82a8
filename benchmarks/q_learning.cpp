// Q-learning on a table of transitions in C++, written to win, twice. Neither knows ends or time limits but a fixed number of steps.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

// xorshift64 (Marsaglia 2003)
static inline uint64_t draw(uint64_t &x) { x ^= x << 13; x ^= x >> 7; return x ^= x << 17; }
static inline double unit(uint64_t &x) { return static_cast<double>(draw(x) >> 11) * 0x1.0p-53; }
static inline size_t below(size_t n, uint64_t &x) { return static_cast<size_t>(unit(x) * static_cast<double>(n)); }

constexpr double ALPHA = 0.1, GAMMA = 0.95, EPSILON = 0.1;

// Two plain passes a step: the first of the largest entries of this row, and the largest entry of the next one. No random ties.
extern "C" void two_passes(const uint32_t *next, const double *reward, double *q, size_t A, size_t episodes, size_t steps, uint64_t *seed) {
    uint64_t x = *seed;
    for (size_t episode = 0; episode < episodes; ++episode) {
        size_t s = 0;
        for (size_t step = 0; step < steps; ++step) {
            const double *row = q + s * A;
            size_t a = 0;
            if (unit(x) < EPSILON) {
                a = below(A, x);
            } else {
                double best = row[0];
                for (size_t b = 1; b < A; ++b)
                    if (row[b] > best) { best = row[b]; a = b; }
            }
            const size_t i = s * A + a;
            s = next[i];
            const double *there = q + s * A;
            double best = there[0];
            for (size_t b = 1; b < A; ++b) best = there[b] > best ? there[b] : best;
            q[i] += ALPHA * (reward[i] + GAMMA * best - q[i]);
        }
    }
    *seed = x;
}

// Every trick of the kernel: one record for each outcome, and of each row its maximum, its place, its ties and a bound on the others.
struct Outcome { double reward; uint32_t next; uint32_t unused; };
struct Row { double largest, bound; uint32_t first, ties; int64_t known; };

static void look(const double *row, size_t A, Row &r) {
    double largest = row[0], bound = -std::numeric_limits<double>::infinity();
    uint32_t first = 0, ties = 0;
    for (size_t b = 1; b < A; ++b) largest = row[b] > largest ? row[b] : largest;
    for (size_t b = A; b-- > 0;) {
        const bool is_largest = row[b] == largest;
        const double other = is_largest ? -std::numeric_limits<double>::infinity() : row[b];
        bound = other > bound ? other : bound;
        first = is_largest ? static_cast<uint32_t>(b) : first;
        ties += is_largest;
    }
    r = {largest, bound, first, ties, 1};
}

extern "C" void followed(const Outcome *outcome, Row *rows, double *q, size_t A, size_t episodes, size_t steps, uint64_t *seed) {
    uint64_t x = *seed;
    for (size_t episode = 0; episode < episodes; ++episode) {
        size_t s = 0;
        if (!rows[s].known) look(q + s * A, A, rows[s]);
        for (size_t step = 0; step < steps; ++step) {
            Row &r = rows[s];
            size_t a;
            if (unit(x) < EPSILON) {
                a = below(A, x);
            } else {
                a = r.first;
                if (r.ties > 1)  // one of them by chance
                    for (size_t skip = below(r.ties, x); skip > 0;) skip -= q[s * A + ++a] == r.largest;
            }
            const size_t i = s * A + a;
            const Outcome &o = outcome[i];
            Row &there = rows[o.next];
            if (!there.known) look(q + o.next * A, A, there);
            const double before = q[i], value = before + ALPHA * (o.reward + GAMMA * there.largest - before);
            q[i] = value;
            if (r.ties == 1 && r.first == a) {
                if (value > r.bound) r.largest = value; else look(q + s * A, A, r);
            } else if (before < r.largest && value < r.largest) {
                r.bound = value > r.bound ? value : r.bound;
            } else if (value > r.largest) {
                r = {value, r.largest, static_cast<uint32_t>(a), 1, 1};
            } else if (value != before) {
                look(q + s * A, A, r);
            }
            s = o.next;
        }
    }
    *seed = x;
}
