/* Dyna-Q on a deterministic table as tuckerl's kernels play it: the same updates, the same draws in the same order, so
 * that steps and tables come out the same to the last bit (compile without contraction of a * b + c). It is the peer that
 * says how near the kernels come to C. And a queue of pairs by priority, the peer of prioritized sweeping's. */

#include "choices.h"

/* The latest outcome of a pair; the discount is 0 where the return ended. */
typedef struct {
    double reward, discount;
    uint32_t next_state;
} Memory;

void play(const int32_t *next_state, const double *reward, const uint8_t *terminated, int64_t n_states,
          int64_t n_actions, int64_t start, int64_t max_steps, int64_t n_episodes, int64_t planning_steps, double alpha,
          double gamma, double epsilon, const double *weights, uint64_t *rng, double *q, int64_t *steps) {
    int64_t A = n_actions, n_observed = 0;
    Memory *model = calloc(n_states * A, sizeof *model);
    uint32_t *observed = calloc(n_states, sizeof *observed), *n_tried = calloc(n_states, sizeof *n_tried);
    uint32_t *tried = calloc(n_states * A, sizeof *tried);
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = start, t = 0;
        int end = 0;
        while (!end && t < max_steps) {
            int64_t a = epsilon_greedy(q + s * A, A, epsilon, rng);
            int64_t k = s * A + a, next = next_state[k];
            double r = reward[k], total;
            end = terminated[k];
            q[k] += alpha * weights[a] * (r + (end ? 0.0 : gamma) * row_max(q + next * A, A) - q[k]);
            total = q[k];
            model[k] = (Memory){r, end ? 0.0 : gamma, (uint32_t)next};
            int64_t place = 0;
            while (place < n_tried[s] && tried[s * A + place] != a) place++;
            if (place == n_tried[s]) {
                if (place == 0) observed[n_observed++] = (uint32_t)s;
                tried[s * A + n_tried[s]++] = (uint32_t)a;
            }
            for (int64_t i = 0; i < planning_steps; i++) {
                int64_t x = observed[below(n_observed, rng)];
                int64_t b = tried[x * A + below(n_tried[x], rng)], j = x * A + b;
                const Memory *m = model + j;
                q[j] += alpha * weights[b] * (m->reward + m->discount * row_max(q + m->next_state * A, A) - q[j]);
                total += q[j];
            }
            if (!isfinite(total)) return;
            s = next;
            t++;
        }
        steps[episode] = t;
    }
    free(model);
    free(observed);
    free(n_tried);
    free(tried);
}

typedef struct {
    double priority;
    int64_t pair;
} Entry;

static inline int goes_first(Entry a, Entry b) {
    return a.priority > b.priority || (a.priority == b.priority && a.pair < b.pair);
}

/* Fill a queue with n pairs, then n times take the first one out and put it in again with a lower priority: returns a
 * sum over what came out, so that nothing is left out, and both programs can be compared. */
double turn_over(int64_t n, int64_t n_turns, uint64_t *rng) {
    Entry *heap = malloc(n * sizeof *heap);
    int64_t *place = malloc(n * sizeof *place), size = 0;
    double total = 0.0;
    for (int64_t turn = 0; turn < n + n_turns; turn++) {
        Entry entry = {uniform(rng), turn};
        if (turn >= n) {
            entry.pair = heap[0].pair;
            entry.priority *= heap[0].priority;
            total += (double)entry.pair;
            Entry last = heap[--size];
            int64_t here = 0, child = 1;
            while (child < size) {
                if (child + 1 < size && goes_first(heap[child + 1], heap[child])) child++;
                if (!goes_first(heap[child], last)) break;
                heap[here] = heap[child];
                place[heap[here].pair] = here + 1;
                here = child;
                child = 2 * child + 1;
            }
            heap[here] = last;
            place[last.pair] = here + 1;
        }
        int64_t here = size++;
        while (here > 0 && goes_first(entry, heap[(here - 1) >> 1])) {
            heap[here] = heap[(here - 1) >> 1];
            place[heap[here].pair] = here + 1;
            here = (here - 1) >> 1;
        }
        heap[here] = entry;
        place[entry.pair] = here + 1;
    }
    total += (double)place[n - 1];
    free(heap);
    free(place);
    return total;
}
