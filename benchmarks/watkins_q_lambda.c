/* Watkins' Q(lambda) with replacing traces on a deterministic table without ends, in two ways: with postponed updates, as
 * the compiled kernel of tuckerl does it (same draws, same order of operations), and with a list of active traces that
 * are all updated at every step and dropped below a cut-off, as C++ libraries do it. A cut empties the list. */

#include "traces.h"

void postponed(const uint32_t *next_state, const double *reward, int64_t S, int64_t A, int64_t max_steps,
               int64_t n_episodes, double alpha, double gamma, double lambda, double epsilon, uint64_t *rng, double *q) {
    Traces e = no_traces(S, A);
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0, a = epsilon_greedy(q, A, epsilon, rng);
        for (int64_t t = 0; t < max_steps; t++) {
            int64_t next = learn_step(&e, q, next_state, reward, A, s, a, alpha, gamma, lambda);
            double *row = q + next * A;
            if (t + 1 == max_steps) break;
            sync_row(&e, q, A, alpha, next);
            if (uniform(rng) < epsilon) {
                a = below(A, rng);
                if (row[a] < row_max(row, A)) flush(&e, q, A, alpha, 0.0);
            } else {
                a = greedy(row, A, rng);
            }
            s = next;
        }
        flush(&e, q, A, alpha, 0.0);
    }
    free_traces(&e);
}

void active_list(const uint32_t *next_state, const double *reward, int64_t S, int64_t A, int64_t max_steps,
                 int64_t n_episodes, double alpha, double gamma, double lambda, double epsilon, uint64_t *rng, double *q) {
    const double cut = 1e-6;
    double *trace = malloc((size_t)(max_steps + 1) * 8);
    int64_t *pair = malloc((size_t)(max_steps + 1) * 8), *place = malloc((size_t)(S * A) * 8);
    for (int64_t k = 0; k < S * A; k++) place[k] = -1;
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0, a = epsilon_greedy(q, A, epsilon, rng), n = 0;
        for (int64_t t = 0; t < max_steps; t++) {
            int64_t k = s * A + a, next = next_state[k];
            double *row = q + next * A, delta = reward[k] + gamma * row_max(row, A) - q[k];
            if (place[k] < 0) {
                place[k] = n;
                pair[n++] = k;
            }
            trace[place[k]] = 1.0;
            int64_t kept = 0;
            for (int64_t i = 0; i < n; i++) {
                q[pair[i]] += alpha * delta * trace[i];
                double decayed = trace[i] * gamma * lambda;
                if (decayed < cut) {
                    place[pair[i]] = -1;
                } else {
                    place[pair[i]] = kept;
                    pair[kept] = pair[i];
                    trace[kept++] = decayed;
                }
            }
            n = kept;
            if (t + 1 == max_steps) break;
            if (uniform(rng) < epsilon) {
                a = below(A, rng);
                if (row[a] < row_max(row, A)) {
                    for (int64_t i = 0; i < n; i++) place[pair[i]] = -1;
                    n = 0;
                }
            } else {
                a = greedy(row, A, rng);
            }
            s = next;
        }
        for (int64_t i = 0; i < n; i++) place[pair[i]] = -1;
    }
    free(trace);
    free(pair);
    free(place);
}
