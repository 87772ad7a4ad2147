/* Three models with differential equations, written by hand: what random runs of the engine are measured against.
 *
 * Each function makes one run of the model with its name in `flows.rs`, by the same law. The epidemic and the room are
 * solved by the method of the engine: that of Dormand and Prince of order 5, with an error of 1e-9 a step relative to the
 * value, read between its points by polynomials, on which crossings are found by bisection. The ball flies by formula.
 * Prints how many runs reach what the query asks, the moves of all runs, and the nanoseconds that they took.
 *
 * Source of the coefficients: E. Hairer, S. P. Nørsett and G. Wanner, "Solving Ordinary Differential Equations I", II.5 and
 * II.6.
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "random.h"

/* the argument of the logarithm is never 0 */
static inline double exponential(double rate) { return -log(1 - uniform()) / rate; }

static uint64_t moves;

/* A solution of an equation: where it is, and the last step as a polynomial in the part of it that has passed. */
enum { MOST = 5, STAGES = 7 };

struct solution {
    double values[MOST], slopes[STAGES][MOST], polynomial[5][MOST], length, next_length;
};

typedef void Slopes(const double *values, double *slopes);

static const double STAGE[STAGES][STAGES - 1] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
static const double ERROR[STAGES] = {
    71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40,
};
static const double DENSE[STAGES] = {
    -12715105075.0 / 11282082432, 0, 87487479700.0 / 32700410799, -10690763975.0 / 1880347072,
    701980252875.0 / 199316789632, -1453857185.0 / 822651844, 69997945.0 / 29380423,
};

#define INLINE static inline __attribute__((always_inline))

INLINE void begin(struct solution *s, Slopes *slopes) { slopes(s->values, s->slopes[0]); }

/* The next step, as long as the error allows. */
INLINE void step(struct solution *s, int count, Slopes *slopes) {
    for (double length = s->next_length;;) {
        double after[MOST], sum = 0;
        for (int stage = 1; stage < STAGES; stage++) {
            for (int value = 0; value < count; value++) {
                double change = 0;
                for (int known = 0; known < stage; known++) change += STAGE[stage][known] * s->slopes[known][value];
                after[value] = s->values[value] + length * change;
            }
            slopes(after, s->slopes[stage]);
        }
        for (int value = 0; value < count; value++) {
            double error = 0;
            for (int stage = 0; stage < STAGES; stage++) error += ERROR[stage] * s->slopes[stage][value];
            error *= length / (1e-12 + 1e-9 * fmax(fabs(s->values[value]), fabs(after[value])));
            sum += error * error;
        }
        double error = sqrt(sum / count), factor = fmin(fmax(0.9 * pow(error, -0.2), 0.2), 10);
        if (error > 1) {
            length *= fmin(factor, 0.9);
            continue;
        }
        for (int value = 0; value < count; value++) {
            double before = s->values[value], change = after[value] - before, last = 0;
            double first = length * s->slopes[0][value] - change;
            for (int stage = 0; stage < STAGES; stage++) last += DENSE[stage] * s->slopes[stage][value];
            s->polynomial[0][value] = before;
            s->polynomial[1][value] = change;
            s->polynomial[2][value] = first;
            s->polynomial[3][value] = change - length * s->slopes[6][value] - first;
            s->polynomial[4][value] = length * last;
            s->values[value] = after[value];
            s->slopes[0][value] = s->slopes[6][value];
        }
        s->length = length;
        s->next_length = length * factor;
        return;
    }
}

/* A value after this part of the last step. */
INLINE double at(const struct solution *s, int value, double part) {
    const double(*p)[MOST] = s->polynomial;
    double rest = 1 - part;
    return p[0][value] +
           part * (p[1][value] + rest * (p[2][value] + part * (p[3][value] + rest * p[4][value])));
}

/* The part of the last step, at most `end`, after which a value has crossed a bound, upwards if `sign` is 1; infinity if it
 * has not done so at `end`. */
INLINE double crossing(const struct solution *s, int value, double bound, double sign, double end) {
    if (sign * (at(s, value, end) - bound) < 0) return INFINITY;
    double before = 0, after = end;
    for (;;) {
        double middle = before + (after - before) / 2;
        if (middle <= before || middle >= after) return after;
        if (sign * (at(s, value, middle) - bound) < 0)
            before = middle;
        else
            after = middle;
    }
}

/* Goes to a part of the last step, and begins anew there. */
INLINE void stop(struct solution *s, int count, double part) {
    for (int value = 0; value < count; value++) s->values[value] = at(s, value, part);
}

/* Shares of a population; what is open is closed while many are infectious. */
enum { SUSCEPTIBLE, EXPOSED, INFECTIOUS, WARD, RECOVERED, SHARES };

static double contacts, spread;

static inline void epidemic_slopes(const double *share, double *slopes) {
    double infections = contacts * spread * share[INFECTIOUS] * share[SUSCEPTIBLE];
    slopes[SUSCEPTIBLE] = -infections;
    slopes[EXPOSED] = infections - share[EXPOSED] / 5;
    slopes[INFECTIOUS] = share[EXPOSED] / 5 - share[INFECTIOUS] / 4;
    slopes[WARD] = share[INFECTIOUS] / 200 - share[WARD] / 10;
    slopes[RECOVERED] = share[INFECTIOUS] * 49 / 200 + share[WARD] / 10;
}

static bool epidemic(void) {
    struct solution s = {.values = {0.998, 0.002, 0, 0, 0}, .next_length = 1e-3};
    double now = 0;
    bool is_open = true;
    spread = between(0.5, 1.1);
    moves++;
    for (;;) {
        contacts = is_open ? 1 : 0.3;
        begin(&s, epidemic_slopes);
        for (;;) {
            step(&s, SHARES, epidemic_slopes);
            double end = fmin(1, (90 - now) / s.length);
            double full = crossing(&s, WARD, 0.0014, 1, end);
            double turn = is_open ? crossing(&s, INFECTIOUS, 0.03, 1, end) : crossing(&s, INFECTIOUS, 0.01, -1, end);
            if (full <= turn && full < INFINITY) return true;
            if (turn < INFINITY) {
                now += turn * s.length;
                stop(&s, SHARES, turn);
                moves++;
                is_open = !is_open;
                break;
            }
            now += end * s.length;
            if (end < 1) return false;
        }
    }
}

/* A room with a heater that a thermostat switches, and a window that people open and close. */
enum { AIR, WALL, VALUES };

static double heating, leak;

static inline void room_slopes(const double *warmth, double *slopes) {
    slopes[AIR] = heating - leak * (warmth[AIR] - 5) - 2 * (warmth[AIR] - warmth[WALL]);
    slopes[WALL] = (warmth[AIR] - warmth[WALL]) / 2;
}

static bool room(void) {
    struct solution s = {.values = {19, 19}, .next_length = 1e-3};
    bool is_on = false, is_open = false;
    double now = 0, window = exponential(0.5), energy = 0;
    for (;;) {
        heating = is_on ? 30 : 0;
        leak = is_open ? 1.5 : 0.3;
        begin(&s, room_slopes);
        for (;;) {
            step(&s, VALUES, room_slopes);
            double next = fmin(48, window), end = fmin(1, (next - now) / s.length);
            double turn = is_on ? crossing(&s, AIR, 21, 1, end) : crossing(&s, AIR, 18, -1, end);
            double until = fmin(end, turn);
            if (is_on) energy += until * s.length;
            if (energy >= 10) return true;
            now += until * s.length;
            if (until >= 1) continue;
            if (turn == INFINITY && next == 48) return false;
            stop(&s, VALUES, until);
            moves++;
            if (turn < INFINITY) {
                is_on = !is_on;
            } else {
                is_open = !is_open;
                window = now + exponential(is_open ? 4 : 0.5);
            }
            break;
        }
    }
}

/* A ball that loses speed as it bounces, and a bat that strikes it upwards. */
static bool ball(void) {
    double now = 0, height = 10, speed = 0, strike = exponential(3);
    for (;;) {
        double ground = now + (speed + sqrt(speed * speed + 20 * height)) / 10;
        double next = fmin(ground, strike), end = fmin(next, 30), passed = end - now;
        double square = speed * speed - 20 * (17 - height);
        if (speed > 0 && square >= 0 && (speed - sqrt(square)) / 10 <= passed) return true;
        if (next > 30) return false;
        moves++;
        now = next;
        height += speed * passed - 5 * passed * passed;
        speed -= 10 * passed;
        if (ground <= strike) {
            height = 0;
            speed *= -between(0.8, 0.92);
        } else {
            strike = now + exponential(3);
            if (height <= 2) speed = 8 + 0.6 * fabs(speed);
        }
    }
}

static double nanoseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

/* flows MODEL RUNS SEED */
int main(int argc, char **argv) {
    if (argc != 4) return 1;
    bool (*run)(void) = strcmp(argv[1], "epidemic") == 0 ? epidemic
                        : strcmp(argv[1], "room") == 0   ? room
                        : strcmp(argv[1], "ball") == 0   ? ball
                                                         : NULL;
    if (run == NULL) return 1;
    uint64_t runs = strtoull(argv[2], NULL, 10), satisfied = 0;
    seed(strtoull(argv[3], NULL, 10));
    double begin = nanoseconds();
    for (uint64_t one = 0; one < runs; one++) satisfied += run();
    double end = nanoseconds();
    printf("%llu %llu %f\n", (unsigned long long)satisfied, (unsigned long long)moves, end - begin);
}
