/* Dyna-H and Q-learning on a deterministic table, as the compiled kernels of tuckerl play them: the same updates, the
 * same draws in the same order, so that steps and tables come out the same to the last bit (compile without contraction
 * of a * b + c). It is the peer that says how near the kernels come to C. planning_steps = 0 is Q-learning. */

#include "choices.h"

/* The latest outcome of a pair; the discount is 0 where the return ended. */
typedef struct {
    double reward, discount;
    uint32_t next_state;
} Memory;

void play(const int32_t *next_state, const double *reward, const uint8_t *terminated, const double *heuristic,
          int64_t n_states, int64_t n_actions, int64_t start, int64_t max_steps, int64_t n_episodes,
          int64_t planning_steps, double alpha, double gamma, double epsilon, const double *weights, uint64_t *rng,
          double *q, int64_t *steps) {
    int64_t A = n_actions, n_observed = 0;
    Memory *model = calloc(n_states * A, sizeof *model);
    int64_t *observed = calloc(n_states, sizeof *observed), *farthest = calloc(n_states, sizeof *farthest);
    int64_t *n_farthest = calloc(n_states, sizeof *n_farthest);
    double *distance = calloc(n_states * A, sizeof *distance);
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = start, t = 0;
        int end = 0;
        while (!end && t < max_steps) {
            int64_t a = epsilon_greedy(q + s * A, A, epsilon, rng);
            int64_t k = s * A + a, next = next_state[k];
            double r = reward[k];
            end = terminated[k];
            q[k] += alpha * weights[a] * (r + (end ? 0.0 : gamma) * row_max(q + next * A, A) - q[k]);
            double total = q[k];
            if (planning_steps > 0) {
                if (n_farthest[s] == 0) {
                    observed[n_observed++] = s;
                    for (int64_t b = 0; b < A; b++) distance[s * A + b] = -INFINITY;
                }
                model[k] = (Memory){r, end ? 0.0 : gamma, (uint32_t)next};
                if (distance[k] != heuristic[next]) {
                    distance[k] = heuristic[next];
                    farthest[s] = maxima(distance + s * A, A, n_farthest + s);
                }
            }
            int64_t x = s;
            for (int64_t i = 0; i < planning_steps; i++) {
                int64_t b;
                if (n_farthest[x] > 0) {
                    b = random_maximum(distance + x * A, farthest[x], n_farthest[x], rng);
                } else {
                    x = observed[below(n_observed, rng)];
                    int64_t n_modelled = 0;
                    for (b = 0; b < A; b++) n_modelled += distance[x * A + b] > -INFINITY;
                    int64_t skip = below(n_modelled, rng);
                    for (b = 0; skip > 0 || distance[x * A + b] == -INFINITY; b++)
                        skip -= distance[x * A + b] > -INFINITY;
                }
                int64_t j = x * A + b, y = model[j].next_state;
                q[j] += alpha * weights[b] * (model[j].reward + model[j].discount * row_max(q + y * A, A) - q[j]);
                total += q[j];
                x = y;
            }
            if (!isfinite(total)) return;
            s = next;
            t++;
        }
        steps[episode] = t;
    }
    free(model);
    free(farthest);
    free(n_farthest);
    free(observed);
    free(distance);
}
