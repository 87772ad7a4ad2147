/* Three stochastic models written by hand: what random runs of the engine are measured against.
 *
 * Each function makes one run of the model with its name in `stochastic.rs`, by the same law: delays are drawn once and
 * kept as moments, and only who moved, or was woken, draws again. Prints how many runs reach what the query asks, the
 * moves of all runs, and the nanoseconds that they took.
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "random.h"

/* of a mean; the argument of the logarithm is never 0 */
static inline double exponential(double mean) { return -mean * log(1 - uniform()); }
/* of 0 .. count - 1 */
static inline unsigned one_of(unsigned count) { return (unsigned)((draw() >> 32) * count >> 32); }

static uint64_t moves;

/* Trucks share a bridge for one. Who comes to an empty bridge goes on; the others stop, in a queue. */
enum { TRUCKS = 6 };

static bool bridge(void) {
    enum { AWAY, NEAR, STOPPED, STARTING, CROSSING } place[TRUCKS] = {AWAY};
    double next[TRUCKS];
    unsigned queue[TRUCKS], first = 0, length = 0;
    for (int truck = 0; truck < TRUCKS; truck++) next[truck] = exponential(120.0 / (1 + truck));
    for (;;) {
        int truck = 0;
        for (int other = 1; other < TRUCKS; other++)
            if (next[other] < next[truck]) truck = other;
        double now = next[truck];
        if (now > 200) return false;
        moves++;
        switch (place[truck]) {
        case AWAY:
            queue[(first + length++) % TRUCKS] = truck;
            if (length == 1) {
                place[truck] = NEAR;
                next[truck] = now + between(8, 16);
            } else {
                if (length == TRUCKS) return true;
                /* The gate stops it at once. */
                moves++;
                place[truck] = STOPPED;
                next[truck] = INFINITY;
            }
            break;
        case NEAR:
        case STARTING:
            place[truck] = CROSSING;
            next[truck] = now + between(3, 5);
            break;
        case CROSSING:
            place[truck] = AWAY;
            next[truck] = now + exponential(120.0 / (1 + truck));
            first = (first + 1) % TRUCKS;
            if (--length > 0) {
                /* The gate wakes the first one at once. */
                moves++;
                place[queue[first]] = STARTING;
                next[queue[first]] = now + between(6, 12);
            }
            break;
        case STOPPED:
            break;
        }
    }
}

/* People do their chores one after the other, each with a tool of which there is one; the pauses are exponential. */
enum { PEOPLE = 4, CHORES = 5 };

static bool workshop(void) {
    static const double least[CHORES] = {1, 2, 3, 2, 1}, most[CHORES] = {3, 5, 4, 6, 2};
    enum { RESTING, WAITING, WORKING, DONE } doing[PEOPLE] = {RESTING};
    bool is_taken[CHORES] = {false};
    unsigned done[PEOPLE] = {0}, ready = 0;
    double next[PEOPLE];
    for (int person = 0; person < PEOPLE; person++) next[person] = exponential(4.0 / (2 + person));
    for (;;) {
        int person = 0;
        for (int other = 1; other < PEOPLE; other++)
            if (next[other] < next[person]) person = other;
        double now = next[person];
        if (now > 30) return false;
        moves++;
        unsigned chore = (person + done[person]) % CHORES;
        if (doing[person] == RESTING) {
            doing[person] = WAITING;
            next[person] = INFINITY;
        } else {
            is_taken[chore] = false;
            if (++done[person] == CHORES) {
                doing[person] = DONE;
                next[person] = INFINITY;
                if (++ready == PEOPLE) return true;
            } else {
                doing[person] = RESTING;
                next[person] = now + exponential(4.0 / (2 + person));
            }
        }
        if (is_taken[chore]) continue;
        /* One of those who wait for this tool takes it, all with the same chance. */
        unsigned waiting[PEOPLE], count = 0;
        for (int other = 0; other < PEOPLE; other++)
            if (doing[other] == WAITING && (other + done[other]) % CHORES == chore) waiting[count++] = other;
        if (count > 0) {
            unsigned taker = count == 1 ? waiting[0] : waiting[one_of(count)];
            moves++;
            is_taken[chore] = true;
            doing[taker] = WORKING;
            next[taker] = now + between(least[chore], most[chore]);
        }
    }
}

/* A queue with one server; every change is told to an observer, who counts how often the queue was empty. */
static bool queue(void) {
    double arrival = exponential(10.0 / 9), service = INFINITY;
    unsigned length = 0, emptied = 0;
    for (;;) {
        if (arrival < service) {
            double now = arrival;
            if (now > 100) return false;
            moves++;
            arrival = now + exponential(10.0 / 9);
            if (length++ == 0) service = now + exponential(1);
            if (length >= 15) return true;
        } else {
            double now = service;
            if (now > 100) return false;
            moves++;
            if (--length == 0) {
                service = INFINITY;
                if (++emptied >= 40) return true;
            } else {
                service = now + exponential(1);
            }
        }
    }
}

static double nanoseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

/* stochastic MODEL RUNS SEED */
int main(int argc, char **argv) {
    if (argc != 4) return 1;
    bool (*run)(void) = strcmp(argv[1], "bridge") == 0     ? bridge
                        : strcmp(argv[1], "workshop") == 0 ? workshop
                        : strcmp(argv[1], "queue") == 0    ? queue
                                                           : NULL;
    if (run == NULL) return 1;
    uint64_t runs = strtoull(argv[2], NULL, 10), satisfied = 0;
    seed(strtoull(argv[3], NULL, 10));
    double begin = nanoseconds();
    for (uint64_t one = 0; one < runs; one++) satisfied += run();
    double end = nanoseconds();
    printf("%llu %llu %f\n", (unsigned long long)satisfied, (unsigned long long)moves, end - begin);
}
