/* Team-Q: Watkins' Q(lambda) on joint actions, with replacing traces and postponed updates, on a deterministic table
 * without ends, as the compiled kernel of tuckerl does it (same draws). Each agent of the team explores on its own. */

#include "traces.h"

/* Return a joint action; `*is_greedy` where no agent explored. The last agent's part counts ones. */
static inline int64_t choose(const double *row, int64_t A, const int64_t *sizes, int64_t n_agents, double epsilon,
                             uint64_t *rng, int *is_greedy) {
    int64_t parts[16], n_exploring = 0, action = 0;
    for (int64_t i = 0; i < n_agents; i++) {
        parts[i] = -1;
        if (uniform(rng) < epsilon) {
            parts[i] = below(sizes[i], rng);
            n_exploring++;
        }
    }
    *is_greedy = n_exploring == 0;
    int64_t joint = n_exploring < n_agents ? greedy(row, A, rng) : 0;
    if (n_exploring == 0) return joint;
    for (int64_t i = n_agents - 1, place = 1; i >= 0; i--) {
        action += (parts[i] >= 0 ? parts[i] : joint % sizes[i]) * place;
        joint /= sizes[i];
        place *= sizes[i];
    }
    return action;
}

void play(const uint32_t *next_state, const double *reward, const int64_t *sizes, int64_t n_agents, int64_t S, int64_t A,
          int64_t max_steps, int64_t n_episodes, double alpha, double gamma, double lambda, double epsilon,
          uint64_t *rng, double *q) {
    Traces e = no_traces(S, A);
    int is_greedy;
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0, a = choose(q, A, sizes, n_agents, epsilon, rng, &is_greedy);
        for (int64_t t = 0; t < max_steps; t++) {
            int64_t next = learn_step(&e, q, next_state, reward, A, s, a, alpha, gamma, lambda);
            double *row = q + next * A;
            if (t + 1 == max_steps) break;
            sync_row(&e, q, A, alpha, next);
            a = choose(row, A, sizes, n_agents, epsilon, rng, &is_greedy);
            if (!is_greedy && row[a] < row_max(row, A)) flush(&e, q, A, alpha, 0.0);
            s = next;
        }
        flush(&e, q, A, alpha, 0.0);
    }
    free_traces(&e);
}
