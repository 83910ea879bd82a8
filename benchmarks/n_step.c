/* Expected SARSA, Double Q-learning and n-step SARSA on a deterministic table, written to win: the same draws and results as the
 * compiled kernels of tuckerl, but for rounding. A row is looked through once where it can be: what is known of the next state's row
 * from the target serves the choice there, and rows of many actions are followed, not looked through. */

#include "choices.h"

typedef struct { double reward; uint32_t next, ends; } Outcome;
typedef struct { double largest, bound; int32_t first, ties, known; } Row;

enum { FOLLOWED_FROM = 10 };

static inline void look(const double *q, int64_t A, Row *r) {
    double largest = q[0], bound = -INFINITY;
    int32_t first = 0, ties = 0;
    for (int64_t a = 1; a < A; a++) largest = q[a] > largest ? q[a] : largest;
    for (int64_t a = A - 1; a >= 0; a--) {
        int is_largest = q[a] == largest;
        double other = is_largest ? -INFINITY : q[a];
        bound = other > bound ? other : bound;
        first = is_largest ? (int32_t)a : first;
        ties += is_largest;
    }
    *r = (Row){largest, bound, first, ties, 1};
}

static inline Row known(const double *q, int64_t A, Row *rows, int64_t s) {
    if (A < FOLLOWED_FROM) {
        Row r;
        look(q + s * A, A, &r);
        return r;
    }
    if (!rows[s].known) look(q + s * A, A, rows + s);
    return rows[s];
}

static inline void change(double *q, int64_t A, Row *rows, int64_t s, int64_t a, double value) {
    double before = q[s * A + a];
    q[s * A + a] = value;
    if (A < FOLLOWED_FROM || !rows[s].known) return;
    Row *r = rows + s;
    if (r->ties == 1 && r->first == a) {
        if (value > r->bound) r->largest = value;
        else look(q + s * A, A, r);
    } else if (before < r->largest && value < r->largest) {
        r->bound = value > r->bound ? value : r->bound;
    } else if (value > r->largest) {
        *r = (Row){value, r->largest, (int32_t)a, 1, 1};
    } else if (value != before) {
        look(q + s * A, A, r);
    }
}

static inline int64_t choose(const double *q, int64_t A, const Row *r, double epsilon, uint64_t *rng) {
    return uniform(rng) < epsilon ? below(A, rng) : random_maximum(q, r->first, r->ties, rng);
}

void expected_sarsa(const Outcome *outcome, int64_t S, int64_t A, int64_t max_steps, int64_t n_episodes, double alpha, double gamma,
                    double epsilon, uint64_t *rng, double *q) {
    Row *rows = calloc(S, sizeof(Row));
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0;
        Row here = known(q, A, rows, s);
        for (int64_t t = 1;; t++) {
            int64_t a = choose(q + s * A, A, &here, epsilon, rng);
            Outcome o = outcome[s * A + a];
            const double *there = q + (int64_t)o.next * A;
            Row next = known(q, A, rows, o.next);
            double sum = 0.0;
            for (int64_t b = 0; b < A; b++) sum += there[b];
            double expected = epsilon / (double)A * sum + (1.0 - epsilon) * next.largest, value = q[s * A + a];
            value += alpha * (o.reward + (o.ends ? 0.0 : gamma) * expected - value);
            change(q, A, rows, s, a, value);
            if (o.ends || t == max_steps) break;
            here = o.next == s ? known(q, A, rows, s) : next;
            s = o.next;
        }
    }
    free(rows);
}

void double_q(const Outcome *outcome, int64_t S, int64_t A, int64_t max_steps, int64_t n_episodes, double alpha, double gamma,
              double epsilon, uint64_t *rng, double *q) {
    Row *rows = calloc(S, sizeof(Row));
    double *tables[2] = {calloc(S * A, 8), calloc(S * A, 8)};
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0;
        for (int64_t t = 1;; t++) {
            Row here = known(q, A, rows, s);
            int64_t a = choose(q + s * A, A, &here, epsilon, rng);
            Outcome o = outcome[s * A + a];
            int second = uniform(rng) < 0.5;
            double *learning = tables[second];
            const double *valuing = tables[!second], *there = learning + (int64_t)o.next * A;
            int64_t ties, best = maxima(there, A, &ties);
            best = random_maximum(there, best, ties, rng);
            double value = learning[s * A + a], worth = valuing[(int64_t)o.next * A + best];
            value += alpha * (o.reward + (o.ends ? 0.0 : gamma) * worth - value);
            learning[s * A + a] = value;
            change(q, A, rows, s, a, 0.5 * value + 0.5 * valuing[s * A + a]);
            if (o.ends || t == max_steps) break;
            s = o.next;
        }
    }
    free(tables[0]);
    free(tables[1]);
    free(rows);
}

typedef struct { int64_t s, a; double reward; } Step;

static inline void learn(double *q, int64_t A, Row *rows, const Step *step, double alpha, double target) {
    double value = q[step->s * A + step->a];
    change(q, A, rows, step->s, step->a, value + alpha * (target - value));
}

/* The sum of n rewards is found as the kernel finds it, at the same cost for every n. */
void n_step_sarsa(const Outcome *outcome, int64_t S, int64_t A, int64_t n, int64_t max_steps, int64_t n_episodes, double alpha,
                  double gamma, double epsilon, uint64_t *rng, double *q) {
    Row *rows = calloc(S, sizeof(Row));
    Step *steps = calloc(n, sizeof(Step));
    double *powers = calloc(n + 1, 8);
    powers[0] = 1.0;
    for (int64_t k = 1; k <= n; k++) powers[k] = gamma * powers[k - 1];
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0, place = 0, count = 0;
        double block = 0.0;
        Row here = known(q, A, rows, s);
        int64_t a = choose(q, A, &here, epsilon, rng);
        for (int64_t t = 1;; t++) {
            Outcome o = outcome[s * A + a];
            Row next = known(q, A, rows, o.next);
            int64_t next_a = choose(q + (int64_t)o.next * A, A, &next, epsilon, rng);
            int over = o.ends || t == max_steps;
            double discount = o.ends ? 0.0 : gamma;
            steps[place] = (Step){s, a, o.reward};
            block += powers[place++] * o.reward;
            if (place == n || over)
                for (int64_t k = place - 2; k >= 0; k--) steps[k].reward += gamma * steps[k + 1].reward;
            if (place == n) {
                place = 0;
                block = 0.0;
            }
            count += count < n;
            if (count == n)
                learn(q, A, rows, steps + place, alpha,
                      powers[n - place] * block + steps[place].reward + powers[n - 1] * discount * q[(int64_t)o.next * A + next_a]);
            if (over) {
                for (int64_t left = count < n ? count : n - 1; left > 0; left--) {
                    int64_t k = place - left;
                    double target = 0.0;
                    if (k < 0) {
                        k += n;
                        target = powers[n - k] * block;
                    }
                    learn(q, A, rows, steps + k, alpha,
                          target + steps[k].reward + powers[left - 1] * discount * q[(int64_t)o.next * A + next_a]);
                }
                break;
            }
            s = o.next;
            a = next_a;
        }
    }
    free(rows);
    free(steps);
    free(powers);
}
