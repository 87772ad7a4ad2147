/* The operations of `zones.rs` by UDBM, on the same zones: a yardstick, compiled only where its sources are at hand.
 *
 * Reads the dimension, the number of cases, the greatest constants of lower and of upper comparisons of each clock, and the
 * cases: the clocks and bounds of the step, the zone, and another zone. A bound is twice its constant, and one more if it is
 * weak. Writes the sum of all finite bounds after the steps without extrapolation, which shows whether both did the same,
 * and nanoseconds for each operation, copying the source included.
 */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <dbm/dbm.h>

#define NO_BOUND 2147483647
#define ROUNDS 50

typedef struct {
    int guarded, at_least, reset, limited, at_most;
    raw_t *zone, *other, *delayed;
} Case;

static int dimension, cases;
static int32_t *lower, *upper;
static Case *all;
static volatile int sink;

static int number(void) {
    int value;
    if (scanf("%d", &value) != 1) {
        fprintf(stderr, "the cases end too early\n");
        exit(1);
    }
    return value;
}

static raw_t *zone(void) {
    raw_t *bounds = malloc(sizeof(raw_t) * dimension * dimension);
    for (int index = 0; index < dimension * dimension; index++) {
        int bound = number();
        bounds[index] = bound == NO_BOUND ? dbm_LS_INFINITY : bound;
    }
    return bounds;
}

static int delay(raw_t *zone, const Case *c) {
    if (!dbm_constrain1(zone, dimension, 0, c->guarded, c->at_least)) return 0;
    dbm_updateValue(zone, dimension, c->reset, 0);
    dbm_up(zone, dimension);
    return dbm_constrain1(zone, dimension, c->limited, 0, c->at_most);
}

enum { COPY, CLOSE, CONSTRAIN, UP, RESET, EXTRAPOLATE, SUBSET, FULL, OPERATIONS };

static int operate(int operation, raw_t *zone, const Case *c) {
    switch (operation) {
    case CLOSE: return dbm_close(zone, dimension);
    case CONSTRAIN: return dbm_constrain1(zone, dimension, 0, c->guarded, c->at_least);
    case UP: dbm_up(zone, dimension); return 1;
    case RESET: dbm_updateValue(zone, dimension, c->reset, 0); return 1;
    case EXTRAPOLATE:
        memcpy(zone, c->delayed, sizeof(raw_t) * dimension * dimension);
        dbm_diagonalExtrapolateLUBounds(zone, dimension, lower, upper);
        return 1;
    case SUBSET: return dbm_isSubsetEq(zone, c->other, dimension);
    case FULL:
        if (!delay(zone, c)) return 0;
        dbm_diagonalExtrapolateLUBounds(zone, dimension, lower, upper);
        return 1;
    default: return 1;
    }
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

int main(void) {
    dimension = number();
    cases = number();
    size_t size = sizeof(raw_t) * dimension * dimension;
    lower = malloc(sizeof(int32_t) * dimension);
    upper = malloc(sizeof(int32_t) * dimension);
    for (int clock = 0; clock < dimension; clock++) lower[clock] = number();
    for (int clock = 0; clock < dimension; clock++) upper[clock] = number();
    all = malloc(sizeof(Case) * cases);
    raw_t *scratch = malloc(size);
    long long sum = 0;
    for (int index = 0; index < cases; index++) {
        Case *c = &all[index];
        c->guarded = number();
        c->at_least = number();
        c->reset = number();
        c->limited = number();
        c->at_most = number();
        c->zone = zone();
        c->other = zone();
        c->delayed = malloc(size);
        memcpy(c->delayed, c->zone, size);
        delay(c->delayed, c);
        for (int entry = 0; entry < dimension * dimension; entry++)
            if (c->delayed[entry] != dbm_LS_INFINITY) sum += c->delayed[entry];
    }
    printf("%lld", sum);
    for (int operation = 0; operation < OPERATIONS; operation++) {
        double fastest = 1e9;
        for (int round = 0; round < ROUNDS; round++) {
            double start = seconds();
            for (int index = 0; index < cases; index++) {
                memcpy(scratch, all[index].zone, size);
                sink = operate(operation, scratch, &all[index]);
            }
            double taken = seconds() - start;
            if (taken < fastest) fastest = taken;
        }
        printf(" %.2f", fastest * 1e9 / cases);
    }
    printf("\n");
    return 0;
}
