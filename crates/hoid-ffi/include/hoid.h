/* hoid: estimates of a person who controls a machine, sample by sample.
 *
 * Every function that can fail answers with a hoid_status: 0 for done, positive where there is no
 * value now, negative for an error; hoid_last_error says what is behind the last one of the thread.
 * One thread at a time may use a tracker; trackers are independent of each other.
 *
 * Made by cargo xtask ffi --header from crates/hoid-ffi; not to be edited. */

#ifndef HOID_H
#define HOID_H

#include <stddef.h>
#include <stdint.h>

/*
 Version of this interface. Functions and constants are added within a version, and never changed.
 */
#define HOID_ABI_VERSION 1

/*
 No check found a problem with the estimate.
 */
#define HOID_TRUSTWORTHY 0

/*
 A check found a problem with the estimate.
 */
#define HOID_DOUBTFUL 1

/*
 The data do not determine the estimate, or there is none.
 */
#define HOID_NOT_DETERMINED 2

/*
 Number of quantities of a change.
 */
#define HOID_SHIFTS 6

/*
 A tracker. Make it with hoid_tracker_new, hoid_tracker_from_fit or hoid_tracker_restore, free it with
 hoid_tracker_free. One thread at a time may use it.
 */
typedef struct hoid_tracker hoid_tracker;

/*
 Return code of a function: zero for done, positive if there is no value, negative for an error.
 */
typedef int32_t hoid_status;

/*
 A number with its standard error.
 */
typedef struct {
  /*
   Its name; valid as long as the tracker.
   */
  const char *name;
  /*
   Its unit, empty if there is none; always valid.
   */
  const char *unit;
  /*
   The value.
   */
  double value;
  /*
   Its standard error; NaN if there is none.
   */
  double standard_error;
  /*
   1 if the data determine it, 0 if they do not, -1 if that is not judged.
   */
  int32_t determined;
} hoid_estimate;

/*
 A quantity before and after a change.
 */
typedef struct {
  /*
   Its name; always valid.
   */
  const char *name;
  /*
   Value before the change.
   */
  double before;
  /*
   Its standard error; NaN if there is none.
   */
  double before_standard_error;
  /*
   Value after the change.
   */
  double after;
  /*
   Its standard error; NaN if there is none.
   */
  double after_standard_error;
  /*
   The change divided by its standard error; for the remnant, the change of the logarithm.
   */
  double z;
} hoid_shift;

/*
 A declared change of the person.
 */
typedef struct {
  /*
   Time from the change to its declaration, s.
   */
  double seconds_ago;
  /*
   `adaptive`: -ln of the p-value of the change test; `multiple-model`: logarithm of the odds of
   a change within the last four seconds.
   */
  double log_odds;
  /*
   1/(1 + exp(-log_odds)); with `multiple-model` the probability of the change.
   */
  double probability;
  /*
   K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm, remnant (innovation variance), tau_e (s).
   */
  hoid_shift shifts[HOID_SHIFTS];
} hoid_change;

/*
 Counts since the start.
 */
typedef struct {
  /*
   Samples.
   */
  uint64_t samples;
  /*
   Samples with a fault in e or u.
   */
  uint64_t skipped;
  /*
   Samples that the guard held back.
   */
  uint64_t held;
  /*
   Restarts of the estimate by the guard.
   */
  uint64_t restarts;
  /*
   Steps shortened to keep stability or a bound.
   */
  uint64_t steps_shortened;
} hoid_counts;

/*
 Result of a sample.
 */
typedef struct {
  /*
   A-priori innovation; NaN at a sample that was skipped or held back, and during a warm-up.
   */
  double innovation;
  /*
   1 after the warm-up; always 1 for a method without one.
   */
  int32_t ready;
  /*
   1 if e or u was faulty: not a finite number, or beyond `largest`.
   */
  int32_t skipped;
  /*
   1 if the guard held back the sample.
   */
  int32_t held;
  /*
   1 if the step was shortened to keep stability or a bound.
   */
  int32_t shortened;
  /*
   1 if a change of the person was declared at this sample.
   */
  int32_t changed;
} hoid_outcome;

/*
 Done.
 */
#define HOID_OK 0

/*
 There is no such value now; hoid_last_error gives the reason.
 */
#define HOID_NOTHING 1

/*
 A pointer is null or not aligned.
 */
#define HOID_BAD_POINTER -1

/*
 A text is not in UTF-8.
 */
#define HOID_BAD_TEXT -2

/*
 A method, an option, a sample time or a fit that cannot be used.
 */
#define HOID_BAD_OPTION -3

/*
 A list or buffer is too short.
 */
#define HOID_TOO_SMALL -4

/*
 Bytes that are not a saved tracker of this version, or were changed.
 */
#define HOID_BAD_STATE -5

/*
 An internal error of hoid was caught.
 */
#define HOID_PANIC -6

/*
 An internal error was caught in this tracker before: free it.
 */
#define HOID_BROKEN -7

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 Version of the interface of the loaded library: compare it with HOID_ABI_VERSION of the header.
 */
uint32_t hoid_abi_version(void);

/*
 The version of hoid, such as "0.1.0".
 */
const char *hoid_version(void);

/*
 Makes a tracker from the name of the method (NULL: "adaptive", whose first estimate comes after one
 second), the sample time in s, and options as one JSON object with the keywords of pyhoid.Tracker
 (NULL: none), such as "{\"controlled_element\": \"90/(s(s+6))\", \"prior\": \"fit.json\"}".

 # Safety
 Texts are NULL or end with a zero; `tracker` points to room for a pointer.
 */
hoid_status hoid_tracker_new(const char *method,
                             double sample_time,
                             const char *options,
                             hoid_tracker **tracker);

/*
 Makes a tracker that starts with an earlier fit of the person, the text that hoid identify --json
 prints. Sample time in s and options as in hoid_tracker_new.

 # Safety
 As hoid_tracker_new.
 */
hoid_status hoid_tracker_from_fit(const char *fit,
                                  double sample_time,
                                  const char *options,
                                  hoid_tracker **tracker);

/*
 Frees a tracker; does nothing for NULL.

 # Safety
 `tracker` is NULL or was made here and not freed.
 */
void hoid_tracker_free(hoid_tracker *tracker);

/*
 Saves a tracker as bytes, to continue in another process with the same digits. With `buffer` NULL and `room` 0 only
 the length is reported.

 # Safety
 `tracker` was made here; `buffer` has room for `room` bytes, `length` for a number.
 */
hoid_status hoid_tracker_save(hoid_tracker *tracker,
                              uint8_t *buffer,
                              size_t room,
                              size_t *length);

/*
 Restores a saved tracker.

 # Safety
 `buffer` has `length` bytes; `tracker` points to room for a pointer.
 */
hoid_status hoid_tracker_restore(const uint8_t *buffer, size_t length, hoid_tracker **tracker);

/*
 HOID_OK after the warm-up, and always for a method without one; HOID_NOTHING during it:
 hoid_last_error then reports how far it is.

 # Safety
 `tracker` was made here.
 */
hoid_status hoid_tracker_ready(const hoid_tracker *tracker);

/*
 The operator: K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e with standard errors.

 # Safety
 `tracker` was made here; `estimates` has room for `room`, `count` for a number.
 */
hoid_status hoid_tracker_operator(const hoid_tracker *tracker,
                                  hoid_estimate *estimates,
                                  size_t room,
                                  size_t *count);

/*
 The coefficients in the order of theta, with standard errors.

 # Safety
 As hoid_tracker_operator.
 */
hoid_status hoid_tracker_parameters(const hoid_tracker *tracker,
                                    hoid_estimate *estimates,
                                    size_t room,
                                    size_t *count);

/*
 The covariance of the coefficients, row by row.

 # Safety
 As hoid_tracker_operator.
 */
hoid_status hoid_tracker_covariance(const hoid_tracker *tracker,
                                    double *covariance,
                                    size_t room,
                                    size_t *count);

/*
 Crossover frequency (crossover_rad_s) and phase margin (phase_margin_deg) with the controlled
 element of the options.

 # Safety
 As hoid_tracker_operator.
 */
hoid_status hoid_tracker_open_loop(const hoid_tracker *tracker,
                                   hoid_estimate *estimates,
                                   size_t room,
                                   size_t *count);

/*
 Gain (gain_db) and phase (phase_deg) at a frequency in rad/s.

 # Safety
 As hoid_tracker_operator.
 */
hoid_status hoid_tracker_response(const hoid_tracker *tracker,
                                  double omega,
                                  hoid_estimate *estimates,
                                  size_t room,
                                  size_t *count);

/*
 The change that was declared at the last sample; HOID_NOTHING if there was none.

 # Safety
 `tracker` was made here; `change` has room for one.
 */
hoid_status hoid_tracker_change(const hoid_tracker *tracker, hoid_change *change);

/*
 Evidence of a change now, as log_odds of hoid_change; before the first estimate 0 (`adaptive`) or
 -inf (`multiple-model`). HOID_NOTHING for a method that does not report changes.

 # Safety
 `tracker` was made here; `log_odds` has room for a number.
 */
hoid_status hoid_tracker_change_log_odds(const hoid_tracker *tracker, double *log_odds);

/*
 Verdict on the current estimate: HOID_TRUSTWORTHY, HOID_DOUBTFUL or HOID_NOT_DETERMINED.

 # Safety
 `tracker` was made here; `level` has room for a number.
 */
hoid_status hoid_tracker_level(const hoid_tracker *tracker, int32_t *level);

/*
 A level as text, such as "trustworthy"; empty for any other number.
 */
const char *hoid_level_name(int32_t level);

/*
 Counts of samples since the start.

 # Safety
 `tracker` was made here; `counts` has room for one.
 */
hoid_status hoid_tracker_counts(const hoid_tracker *tracker, hoid_counts *counts);

/*
 Sample time in s.

 # Safety
 `tracker` was made here; `sample_time` has room for a number.
 */
hoid_status hoid_tracker_sample_time(const hoid_tracker *tracker, double *sample_time);

/*
 The text of the last status of this thread that was not HOID_OK, empty before the first. The
 pointer stays valid until the next status of this thread that is not HOID_OK.
 */
const char *hoid_last_error(void);

/*
 Takes a sample: error e and control u. NaN represents missing values. `outcome` may be NULL.

 # Safety
 `tracker` was made here; `outcome` is NULL or has room for one.
 */
hoid_status hoid_tracker_step(hoid_tracker *tracker, double e, double u, hoid_outcome *outcome);

/*
 As hoid_tracker_step, with the external signal f_t (NaN: not known). With `moves` 0 the filters
 are updated, but not the estimate.

 # Safety
 As hoid_tracker_step.
 */
hoid_status hoid_tracker_update(hoid_tracker *tracker,
                                double e,
                                double u,
                                double f_t,
                                int32_t moves,
                                hoid_outcome *outcome);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HOID_H */
