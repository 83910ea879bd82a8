/* Postponed updates as loops in C with traces have them: see the compiled kernels of tuckerl. */

#include "choices.h"

typedef struct {
    double *constant, *synced, product, sum;
    uint8_t *active;
    uint32_t *rows, n_rows;
} Traces;

static inline Traces no_traces(int64_t S, int64_t A) {
    Traces e = {calloc(S * A, 8), calloc(S, 8), 1.0, 0.0, calloc(S, 1), calloc(S, 4), 0};
    return e;
}

static inline void free_traces(Traces *e) {
    free(e->constant);
    free(e->synced);
    free(e->active);
    free(e->rows);
}

static inline void sync_row(Traces *e, double *q, int64_t A, double alpha, int64_t s) {
    double missed = e->sum - e->synced[s];
    if (e->active[s] && missed != 0.0)
        for (int64_t a = 0; a < A; a++) q[s * A + a] += alpha * (e->constant[s * A + a] * missed);
    e->synced[s] = e->sum;
}

/* Bring all rows up to date and begin anew from 1, with all traces times `kept`: 0 forgets them. */
static inline void flush(Traces *e, double *q, int64_t A, double alpha, double kept) {
    for (uint32_t i = 0; i < e->n_rows; i++) {
        int64_t s = e->rows[i];
        sync_row(e, q, A, alpha, s);
        for (int64_t a = 0; a < A; a++) e->constant[s * A + a] *= kept;
        e->active[s] = kept > 0.0;
        e->synced[s] = 0.0;
    }
    e->n_rows = kept > 0.0 ? e->n_rows : 0;
    e->product = 1.0;
    e->sum = 0.0;
}

static inline void activate(Traces *e, int64_t s) {
    if (e->active[s]) return;
    e->active[s] = 1;
    e->synced[s] = e->sum;
    e->rows[e->n_rows++] = (uint32_t)s;
}

/* Let an error reach all traces, and let these decay. */
static inline void spread(Traces *e, double *q, int64_t A, double alpha, double delta, double decay) {
    e->sum += delta * e->product;
    e->product *= decay;
    if (e->product < 1e-4) flush(e, q, A, alpha, e->product);
}

/* A step of Q(lambda) with replacing traces, from the state s by the action a: return the next state. */
static inline int64_t learn_step(Traces *e, double *q, const uint32_t *next_state, const double *reward, int64_t A,
                                 int64_t s, int64_t a, double alpha, double gamma, double lambda) {
    int64_t next = next_state[s * A + a];
    sync_row(e, q, A, alpha, next);
    double delta = reward[s * A + a] + gamma * row_max(q + next * A, A) - q[s * A + a];
    activate(e, s);
    double missed = e->sum - e->synced[s], before = e->constant[s * A + a], after = 1.0 / e->product;
    e->constant[s * A + a] = after;
    q[s * A + a] += alpha * ((before - after) * missed);
    spread(e, q, A, alpha, delta, gamma * lambda);
    return next;
}
