/* Watkins' Q(lambda) with replacing traces on a deterministic table without ends, in two ways: with postponed updates, as
 * the compiled kernel of tuckerl does it (same draws, same order of operations), and with a list of active traces that
 * are all updated at every step and dropped below a cut-off, as C++ libraries do it. A cut empties the list. */

#include "choices.h"

typedef struct {
    double *constant, *synced, product, sum;
    uint8_t *active;
    uint32_t *rows, n_rows;
} Traces;

static inline void sync_row(Traces *e, double *q, int64_t A, double alpha, int64_t s) {
    double missed = e->sum - e->synced[s];
    if (e->active[s] && missed != 0.0)
        for (int64_t a = 0; a < A; a++) q[s * A + a] += alpha * (e->constant[s * A + a] * missed);
    e->synced[s] = e->sum;
}

static void forget(Traces *e, double *q, int64_t A, double alpha) {
    for (uint32_t i = 0; i < e->n_rows; i++) {
        int64_t s = e->rows[i];
        sync_row(e, q, A, alpha, s);
        for (int64_t a = 0; a < A; a++) e->constant[s * A + a] = 0.0;
        e->active[s] = 0;
        e->synced[s] = 0.0;
    }
    e->n_rows = 0;
    e->product = 1.0;
    e->sum = 0.0;
}

static void begin_anew(Traces *e, double *q, int64_t A, double alpha) {
    for (uint32_t i = 0; i < e->n_rows; i++) {
        int64_t s = e->rows[i];
        sync_row(e, q, A, alpha, s);
        for (int64_t a = 0; a < A; a++) e->constant[s * A + a] *= e->product;
        e->synced[s] = 0.0;
    }
    e->product = 1.0;
    e->sum = 0.0;
}

void postponed(const uint32_t *next_state, const double *reward, int64_t S, int64_t A, int64_t max_steps,
               int64_t n_episodes, double alpha, double gamma, double lambda, double epsilon, uint64_t *rng, double *q) {
    Traces e = {calloc(S * A, 8), calloc(S, 8), 1.0, 0.0, calloc(S, 1), calloc(S, 4), 0};
    for (int64_t episode = 0; episode < n_episodes; episode++) {
        int64_t s = 0, a = epsilon_greedy(q, A, epsilon, rng);
        for (int64_t t = 0; t < max_steps; t++) {
            int64_t next = next_state[s * A + a];
            sync_row(&e, q, A, alpha, next);
            double delta = reward[s * A + a] + gamma * row_max(q + next * A, A) - q[s * A + a];
            if (!e.active[s]) {
                e.active[s] = 1;
                e.synced[s] = e.sum;
                e.rows[e.n_rows++] = (uint32_t)s;
            }
            double missed = e.sum - e.synced[s], before = e.constant[s * A + a], after = 1.0 / e.product;
            e.constant[s * A + a] = after;
            q[s * A + a] += alpha * ((before - after) * missed);
            e.sum += delta * e.product;
            e.product *= gamma * lambda;
            if (e.product < 1e-8) begin_anew(&e, q, A, alpha);
            if (t + 1 == max_steps) break;
            sync_row(&e, q, A, alpha, next);
            double *row = q + next * A;
            if (uniform(rng) < epsilon) {
                a = below(A, rng);
                if (row[a] < row_max(row, A)) forget(&e, q, A, alpha);
            } else {
                a = greedy(row, A, rng);
            }
            s = next;
        }
        forget(&e, q, A, alpha);
    }
    free(e.constant);
    free(e.synced);
    free(e.active);
    free(e.rows);
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
