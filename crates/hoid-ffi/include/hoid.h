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
 Nothing speaks against the estimate.
 */
#define HOID_TRUSTWORTHY 0

/*
 Something speaks against the estimate.
 */
#define HOID_DOUBTFUL 1

/*
 The data do not determine the estimate, or there is none.
 */
#define HOID_NOT_DETERMINED 2

/*
 Quantities of a change.
 */
#define HOID_SHIFTS 6

/*
 A tracker. Make it with hoid_tracker_new, hoid_tracker_from_fit or hoid_tracker_restore, free it with
 hoid_tracker_free. One thread at a time may use it.
 */
typedef struct hoid_tracker hoid_tracker;

/*
 Return code of a function: zero for done, positive where there is no value, negative for an
 error.
 */
typedef int32_t hoid_status;

/*
 A number with its standard error.
 */
typedef struct {
  /*
   Its name; it stays as long as the tracker.
   */
  const char *name;
  /*
   Its unit, empty if there is none; it stays.
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
   1 where the data determine it, 0 where they do not, -1 where that is not judged.
   */
  int32_t determined;
} hoid_estimate;

/*
 A quantity before and after a change.
 */
typedef struct {
  /*
   Its name; it stays.
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
   The change over its standard error; for the remnant that of the logarithm.
   */
  double z;
} hoid_shift;

/*
 A change of the person that was declared.
 */
typedef struct {
  /*
   How long ago the person changed when it was declared, s.
   */
  double seconds_ago;
  /*
   Logarithm of the odds of a change within the last few seconds.
   */
  double log_odds;
  /*
   Its probability.
   */
  double probability;
  /*
   K_e, K_e_dot (s), omega_nm (rad/s), zeta_nm, remnant (innovation variance), tau_e (s).
   */
  hoid_shift shifts[HOID_SHIFTS];
} hoid_change;

/*
 Samples so far.
 */
typedef struct {
  /*
   Samples given.
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
   How often the guard started the estimate again.
   */
  uint64_t restarts;
  /*
   Steps that stability or a bound made shorter.
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
   1 once there is an estimate.
   */
  int32_t ready;
  /*
   1 when e or u was faulty: not a finite number, or beyond `largest`.
   */
  int32_t skipped;
  /*
   1 when the guard held it back.
   */
  int32_t held;
  /*
   1 when stability or a bound made the step shorter.
   */
  int32_t shortened;
  /*
   1 when a change of the person was declared at this sample.
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
 A list or buffer has not the room for what there is.
 */
#define HOID_TOO_SMALL -4

/*
 Bytes that are not a saved tracker of this version, or were changed since.
 */
#define HOID_BAD_STATE -5

/*
 A fault of hoid itself was caught.
 */
#define HOID_PANIC -6

/*
 A fault was caught in this tracker before: free it.
 */
#define HOID_BROKEN -7

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/*
 The version of the library that is loaded: compare it with HOID_ABI_VERSION of the header.
 */
uint32_t hoid_abi_version(void);

/*
 The version of hoid, such as "0.1.0".
 */
const char *hoid_version(void);

/*
 Makes a tracker: by the name of the method (NULL: "adaptive", which speaks from the second second
 on), the sample time in s, and options as one object in JSON by the keywords of pyhoid.Tracker
 (NULL: none), as "{\"controlled_element\": \"90/(s(s+6))\", \"prior\": \"fit.json\"}".

 # Safety
 Texts are NULL or end with a zero; `tracker` points to room for a pointer.
 */
hoid_status hoid_tracker_new(const char *method,
                             double sample_time,
                             const char *options,
                             hoid_tracker **tracker);

/*
 Makes a tracker that starts with an earlier fit of the person: the text that hoid identify --json
 prints. Sample time in s and options as in hoid_tracker_new.

 # Safety
 As hoid_tracker_new.
 */
hoid_status hoid_tracker_from_fit(const char *fit,
                                  double sample_time,
                                  const char *options,
                                  hoid_tracker **tracker);

/*
 Frees a tracker. NULL is nothing to be freed.

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
 Makes the tracker that was saved.

 # Safety
 `buffer` has `length` bytes; `tracker` points to room for a pointer.
 */
hoid_status hoid_tracker_restore(const uint8_t *buffer, size_t length, hoid_tracker **tracker);

/*
 HOID_OK once there is an estimate, HOID_NOTHING before; hoid_last_error then reports how far the
 warm-up is.

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
 The covariance of the coefficients by rows.

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
 The change that was declared at the last sample; HOID_NOTHING where none was.

 # Safety
 `tracker` was made here; `change` has room for one.
 */
hoid_status hoid_tracker_change(const hoid_tracker *tracker, hoid_change *change);

/*
 Logarithm of the odds that the person changed within the last four seconds; -inf before the first
 estimate. HOID_NOTHING for a method that does not report changes.

 # Safety
 `tracker` was made here; `log_odds` has room for a number.
 */
hoid_status hoid_tracker_change_log_odds(const hoid_tracker *tracker, double *log_odds);

/*
 Verdict on the estimate now: HOID_TRUSTWORTHY, HOID_DOUBTFUL or HOID_NOT_DETERMINED.

 # Safety
 `tracker` was made here; `level` has room for a number.
 */
hoid_status hoid_tracker_level(const hoid_tracker *tracker, int32_t *level);

/*
 A level as text, as "trustworthy"; empty for what is none.
 */
const char *hoid_level_name(int32_t level);

/*
 Samples so far.

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
 The text after the last status of this thread that was not HOID_OK, empty before the first. The
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
 follow and the estimate stays.

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
