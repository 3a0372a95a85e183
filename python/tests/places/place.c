/* Samples "e,u" on standard input; after each the six parameters of the operator, crossover and phase margin, each with
 * its standard error, and the nanoseconds that the sample took, from the call that takes it to the last that tells of it.
 * C and C++ alike.
 */
#define _POSIX_C_SOURCE 199309L
#include <hoid.h>
#include <math.h>
#include <stdio.h>
#include <time.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

int main(void) {
    hoid_tracker *tracker = NULL;
    const char *options = "{\"controlled_element\": \"90/(s(s+6))\"}";
    if (hoid_tracker_new(NULL, 0.01, options, &tracker) != HOID_OK) {
        fprintf(stderr, "%s\n", hoid_last_error());
        return 1;
    }
    double e, u;
    while (scanf("%lf,%lf", &e, &u) == 2) {
        hoid_estimate estimates[8];
        size_t count = 0;
        double begin = now();
        if (hoid_tracker_step(tracker, e, u, NULL) != HOID_OK) return 1;
        hoid_status known[2];
        known[0] = hoid_tracker_operator(tracker, estimates, 6, &count);
        known[1] = hoid_tracker_open_loop(tracker, estimates + 6, 2, &count);
        double took = now() - begin;
        for (size_t i = 0; i < 8; i++) {
            int is_known = known[i / 6] == HOID_OK;
            double value = is_known ? estimates[i].value : NAN;
            double error = is_known ? estimates[i].standard_error : NAN;
            printf("%.17g,%.17g,", value, error);
        }
        printf("%.0f\n", took);
    }
    hoid_tracker_free(tracker);
    return 0;
}
