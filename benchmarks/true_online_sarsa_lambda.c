/* True online SARSA(lambda), tabular, on a deterministic table without ends, with postponed updates, as the compiled
 * kernel of tuckerl does it (same draws, same order of operations). */

#include "traces.h"

void postponed(const uint32_t *next_state, const double *reward, int64_t S, int64_t A, int64_t max_steps,
               int64_t n_episodes, double alpha, double gamma, double lambda, double epsilon, uint64_t *rng, double *q) {
    Traces e = no_traces(S, A);
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0, a = epsilon_greedy(q, A, epsilon, rng);
        double old = q[a];
        for (int64_t t = 0; t < max_steps; t++) {
            int64_t k = s * A + a, next = next_state[k];
            sync_row(&e, q, A, alpha, next);
            int64_t next_a = epsilon_greedy(q + next * A, A, epsilon, rng);
            activate(&e, s);
            double missed = e.sum - e.synced[s], before = e.constant[k], next_value = q[next * A + next_a];
            double after = (1.0 - alpha) * before + 1.0 / e.product, value = q[k] + alpha * (before * missed);
            e.constant[k] = after;
            q[k] += alpha * ((before - after) * missed) - alpha * (value - old);
            spread(&e, q, A, alpha, reward[k] + gamma * next_value - old, gamma * lambda);
            old = next_value;
            s = next;
            a = next_a;
        }
        flush(&e, q, A, alpha, 0.0);
    }
    free_traces(&e);
}
