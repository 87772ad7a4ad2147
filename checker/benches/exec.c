/* The needle's kinematics written by hand: what compiled code is measured against.
 *
 * The same integer arithmetic as the model, scaled by 1000 and truncated, but as a C programmer would write it: sine and
 * cosine once, no checks. Prints the nanoseconds of a step and of a roll, then the words of the state after the rounds.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef int32_t Vector[3];
typedef int32_t Matrix[3][3];

enum { IDENTITY, BASE, CIRCLE, ACTION, TIP, SCRATCH, MATRICES };
enum { X, Y, Z, TIP_X, TIP_Y, TIP_Z, SCRATCH_1, SCRATCH_2, VECTORS };

static struct {
    int32_t dt, velocity, radius, progress, roll, yaw, rotations;
    Vector tip, centre, vector[VECTORS];
    Matrix matrix[MATRICES];
} needle;

static double real(int32_t scaled) { return scaled / 1000.0; }
static int32_t scale(double value) { return (int32_t)(value * 1000.0); }

static void multiply(int left, int right, int out) {
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) {
            int32_t sum = 0;
            for (int i = 0; i < 3; i++)
                sum += scale(real(needle.matrix[left][row][i]) * real(needle.matrix[right][i][column]));
            needle.matrix[out][row][column] = sum;
        }
    }
}

static void apply(int matrix, int vector, int out) {
    for (int row = 0; row < 3; row++) {
        int32_t sum = 0;
        for (int i = 0; i < 3; i++)
            sum += scale(real(needle.matrix[matrix][row][i]) * real(needle.vector[vector][i]));
        needle.vector[out][row] = sum;
    }
}

static void normalise(int vector) {
    int32_t *v = needle.vector[vector];
    int32_t length = scale(sqrt(pow(real(v[0]), 2) + pow(real(v[1]), 2) + pow(real(v[2]), 2)));
    if (length != 0)
        for (int row = 0; row < 3; row++) v[row] = scale(real(v[row]) / real(length));
}

static void rotation(int axis, int32_t angle, int out) {
    double cosine = cos(real(angle)), sine = sin(real(angle)), rest = 1 - cosine;
    double x = real(needle.vector[axis][0]), y = real(needle.vector[axis][1]), z = real(needle.vector[axis][2]);
    int32_t(*m)[3] = needle.matrix[out];
    m[0][0] = scale(cosine + pow(x, 2) * rest);
    m[0][1] = scale(x * y * rest - z * sine);
    m[0][2] = scale(x * z * rest + y * sine);
    m[1][0] = scale(y * x * rest + z * sine);
    m[1][1] = scale(cosine + pow(y, 2) * rest);
    m[1][2] = scale(y * z * rest - x * sine);
    m[2][0] = scale(z * x * rest - y * sine);
    m[2][1] = scale(z * y * rest + x * sine);
    m[2][2] = scale(cosine + pow(z, 2) * rest);
}

static void update_tip_matrix(void) {
    multiply(CIRCLE, BASE, SCRATCH);
    multiply(ACTION, SCRATCH, TIP);
}

static void update_axes(void) {
    for (int axis = 0; axis < 3; axis++) {
        apply(TIP, X + axis, TIP_X + axis);
        normalise(TIP_X + axis);
    }
}

__attribute__((noinline)) static void step(void) {
    int32_t advance = scale(real(needle.velocity) * needle.dt);
    needle.progress += advance;
    needle.yaw += scale(real(advance) / real(needle.radius));
    apply(BASE, Y, SCRATCH_1);
    normalise(SCRATCH_1);
    rotation(SCRATCH_1, needle.yaw, CIRCLE);
    apply(BASE, Z, SCRATCH_1);
    apply(CIRCLE, SCRATCH_1, SCRATCH_2);
    for (int row = 0; row < 3; row++)
        needle.tip[row] = scale(real(needle.centre[row]) + real(needle.vector[SCRATCH_2][row]) * real(needle.radius));
    update_tip_matrix();
    update_axes();
}

__attribute__((noinline)) static void roll(int32_t degrees) {
    needle.roll = scale(degrees / 180.0 * 3.14159265358979312);
    rotation(TIP_X, needle.roll, ACTION);
    update_tip_matrix();
    update_axes();
    for (int row = 0; row < 3; row++)
        needle.centre[row] = scale(real(needle.tip[row]) - real(needle.radius) * real(needle.vector[TIP_Z][row]));
    update_tip_matrix();
    memcpy(needle.matrix[BASE], needle.matrix[TIP], sizeof(Matrix));
    memcpy(needle.matrix[CIRCLE], needle.matrix[IDENTITY], sizeof(Matrix));
    memcpy(needle.matrix[ACTION], needle.matrix[IDENTITY], sizeof(Matrix));
    needle.yaw = 0;
    needle.rotations++;
}

static double nanoseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

/* exec ROUNDS, with the words of the initial state on the standard input */
int main(int argc, char **argv) {
    int rounds = argc > 1 ? atoi(argv[1]) : 1;
    int32_t *words = (int32_t *)&needle;
    for (size_t i = 0; i < sizeof needle / 4; i++)
        if (scanf("%d", &words[i]) != 1) return 1;
    roll(90);
    double begin = nanoseconds();
    for (int round = 0; round < rounds; round++) step();
    double middle = nanoseconds();
    for (int round = 0; round < rounds; round++) roll(90);
    double end = nanoseconds();
    printf("%f %f", (middle - begin) / rounds, (end - middle) / rounds);
    for (size_t i = 0; i < sizeof needle / 4; i++) printf(" %d", words[i]);
}
