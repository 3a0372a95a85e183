/* Tracks a person live: samples "e,u" on standard input, the operator after each on standard output.
 *
 *     tracker METHOD SAMPLE_TIME [OPTIONS] [RESTART_AT]
 *
 * One line a sample: value and standard error of K_e, T_L, K_e_dot, omega_nm, zeta_nm and tau_e, then
 * crossover and phase margin where the options have a controlled element; "nan" for what is not known.
 * What there was in all goes to standard error. After RESTART_AT samples the tracker is saved, freed
 * and restored: the digits stay the same.
 */
#include <hoid.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Ends the program where a function failed; a value that is not there now is no failure. */
static int is_there(hoid_status status) {
    if (status < 0) {
        fprintf(stderr, "hoid: %s\n", hoid_last_error());
        exit(1);
    }
    return status == HOID_OK;
}

static void print(const hoid_estimate *estimates, size_t expected, size_t count) {
    for (size_t i = 0; i < expected; i++) {
        double value = i < count ? estimates[i].value : NAN;
        double error = i < count ? estimates[i].standard_error : NAN;
        printf("%.17g,%.17g,", value, error);
    }
}

static hoid_tracker *restarted(hoid_tracker *tracker) {
    size_t length = 0;
    is_there(hoid_tracker_save(tracker, NULL, 0, &length));
    uint8_t *bytes = malloc(length);
    if (bytes == NULL) exit(1);
    is_there(hoid_tracker_save(tracker, bytes, length, &length));
    hoid_tracker_free(tracker);
    is_there(hoid_tracker_restore(bytes, length, &tracker));
    free(bytes);
    return tracker;
}

int main(int argc, char **argv) {
    if (argc < 3) {
        fprintf(stderr, "usage: tracker METHOD SAMPLE_TIME [OPTIONS] [RESTART_AT]\n");
        return 2;
    }
    if (hoid_abi_version() != HOID_ABI_VERSION) {
        fprintf(stderr, "the library has another interface than the header\n");
        return 1;
    }
    const char *options = argc > 3 ? argv[3] : NULL;
    long restart_at = argc > 4 ? atol(argv[4]) : -1;
    hoid_tracker *tracker = NULL;
    is_there(hoid_tracker_new(argv[1], atof(argv[2]), options, &tracker));

    double e, u;
    long samples = 0;
    while (scanf("%lf,%lf", &e, &u) == 2) {
        hoid_outcome outcome;
        is_there(hoid_tracker_step(tracker, e, u, &outcome));
        if (outcome.changed) {
            hoid_change change;
            if (is_there(hoid_tracker_change(tracker, &change))) {
                fprintf(stderr, "sample %ld: the person changed %.2f s ago, with probability %.4f\n", samples,
                        change.seconds_ago, change.probability);
            }
        }
        hoid_estimate estimates[6];
        size_t count = 0;
        if (!is_there(hoid_tracker_operator(tracker, estimates, 6, &count))) count = 0;
        print(estimates, 6, count);
        if (!is_there(hoid_tracker_open_loop(tracker, estimates, 6, &count))) count = 0;
        print(estimates, 2, count);
        printf("%.17g\n", outcome.innovation);
        if (++samples == restart_at) tracker = restarted(tracker);
    }

    int32_t level = HOID_NOT_DETERMINED;
    hoid_counts counts;
    is_there(hoid_tracker_level(tracker, &level));
    is_there(hoid_tracker_counts(tracker, &counts));
    fprintf(stderr, "hoid %s: %s after %llu samples, %llu skipped\n", hoid_version(), hoid_level_name(level),
            (unsigned long long)counts.samples, (unsigned long long)counts.skipped);
    hoid_tracker_free(tracker);
    return 0;
}
