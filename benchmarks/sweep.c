/* Sweeps of value iteration in place over a table in which every pair has one outcome, forwards and backwards in turn:
   what tuckerl.solving.sweeps.sweep does there, written to win: four actions are unrolled by the compiler. */
#include <math.h>
#include <stdint.h>

static inline double settled(const double *restrict reward, const uint32_t *restrict next, const double *v, int64_t pair,
                             int64_t state, double gamma) {
    double value = reward[pair] + gamma * v[next[pair]];
    return next[pair] == (uint32_t)state ? (value - gamma * v[state]) / (1.0 - gamma) : value;
}

double sweep(const double *restrict reward, const uint32_t *restrict next, double *v, int64_t *restrict policy,
             int64_t n_states, int64_t n_actions, int64_t n_sweeps, double gamma) {
    double change = 0.0;
    for (int64_t number = 0; number < n_sweeps; number++) {
        change = 0.0;
        for (int64_t i = 0; i < n_states; i++) {
            int64_t state = number % 2 ? n_states - 1 - i : i, chosen = 0;
            double best = -INFINITY;
            for (int64_t a = 0; a < n_actions; a++) {
                double value = settled(reward, next, v, state * n_actions + a, state, gamma);
                if (value > best) {
                    best = value;
                    chosen = a;
                }
            }
            double moved = fabs(best - v[state]);
            change = moved > change ? moved : change;
            v[state] = best;
            policy[state] = chosen;
        }
        if (change == 0.0)
            break;
    }
    return change;
}
