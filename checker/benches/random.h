/* The random numbers of the programs in C that random runs are measured against. */
#include <stdint.h>

/* xoshiro256++ by D. Blackman and S. Vigna, in the public domain, with a state from splitmix64. */
static uint64_t state[4];

static inline uint64_t rotate(uint64_t word, int by) { return word << by | word >> (64 - by); }

static inline uint64_t draw(void) {
    uint64_t result = rotate(state[0] + state[3], 23) + state[0], shifted = state[1] << 17;
    state[2] ^= state[0];
    state[3] ^= state[1];
    state[1] ^= state[2];
    state[0] ^= state[3];
    state[2] ^= shifted;
    state[3] = rotate(state[3], 45);
    return result;
}

static void seed(uint64_t value) {
    for (int word = 0; word < 4; word++) {
        uint64_t mixed = value += 0x9e3779b97f4a7c15;
        mixed = (mixed ^ mixed >> 30) * 0xbf58476d1ce4e5b9;
        mixed = (mixed ^ mixed >> 27) * 0x94d049bb133111eb;
        state[word] = mixed ^ mixed >> 31;
    }
}

/* in [0, 1) */
static inline double uniform(void) { return (double)(draw() >> 11) * 0x1p-53; }
static inline double between(double low, double high) { return low + (high - low) * uniform(); }
