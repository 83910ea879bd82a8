/* SARSA(lambda) with replacing traces on a deterministic table without ends, in two ways: with postponed updates, as the
 * compiled kernel of tuckerl does it (same draws, same order of operations), and with a list of active traces that are
 * all updated at every step and dropped below a cut-off, as C++ libraries do it. */

#include "choices.h"

typedef struct {
    double *constant, *seen, product, sum;
    uint8_t *active;
    uint32_t *rows, n_rows;
} Traces;

static inline void bring_up_to_date(Traces *e, double *q, int64_t A, double alpha, int64_t s) {
    double missed = e->sum - e->seen[s];
    if (e->active[s] && missed != 0.0)
        for (int64_t a = 0; a < A; a++) q[s * A + a] += alpha * e->constant[s * A + a] * missed;
    e->seen[s] = e->sum;
}

static void settle(Traces *e, double *q, int64_t A, double alpha, int keep) {
    uint32_t kept = 0;
    for (uint32_t i = 0; i < e->n_rows; i++) {
        int64_t s = e->rows[i];
        int alive = 0;
        bring_up_to_date(e, q, A, alpha, s);
        for (int64_t a = 0; a < A; a++) {
            double trace = keep ? e->constant[s * A + a] * e->product : 0.0;
            trace = trace < 1e-16 ? 0.0 : trace;
            e->constant[s * A + a] = trace;
            alive |= trace > 0.0;
        }
        e->active[s] = (uint8_t)alive;
        e->seen[s] = 0.0;
        if (alive) e->rows[kept++] = (uint32_t)s;
    }
    e->n_rows = kept;
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
            bring_up_to_date(&e, q, A, alpha, next);
            int64_t next_a = epsilon_greedy(q + next * A, A, epsilon, rng);
            if (!e.active[s]) {
                e.active[s] = 1;
                e.seen[s] = e.sum;
                e.rows[e.n_rows++] = (uint32_t)s;
            }
            double missed = e.sum - e.seen[s], before = e.constant[s * A + a], after = 1.0 / e.product;
            double delta = reward[s * A + a] + gamma * q[next * A + next_a] - (q[s * A + a] + alpha * before * missed);
            e.constant[s * A + a] = after;
            q[s * A + a] += alpha * (before - after) * missed;
            e.sum += delta * e.product;
            e.product *= gamma * lambda;
            if (e.product < 1e-4) settle(&e, q, A, alpha, 1);
            s = next;
            a = next_a;
        }
        settle(&e, q, A, alpha, 0);
    }
    free(e.constant);
    free(e.seen);
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
            int64_t next_a = epsilon_greedy(q + next * A, A, epsilon, rng);
            double delta = reward[k] + gamma * q[next * A + next_a] - q[k];
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
            s = next;
            a = next_a;
        }
        for (int64_t i = 0; i < n; i++) place[pair[i]] = -1;
    }
    free(trace);
    free(pair);
    free(place);
}
