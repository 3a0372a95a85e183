//! Crossings of unit gain and of the negative real axis by a frequency response.

use num_complex::Complex64;

/// Margins of an open loop. A quantity that does not exist within the scanned range is `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Gain crossover frequency omega_c in rad/s.
    pub crossover_rad_s: Option<f64>,
    /// Phase margin phi_m at `crossover_rad_s`, in degrees.
    pub phase_margin_deg: Option<f64>,
    /// Phase crossover frequency in rad/s.
    pub phase_crossover_rad_s: Option<f64>,
    /// Gain margin at `phase_crossover_rad_s`, in dB.
    pub gain_margin_db: Option<f64>,
}

/// A frequency range that contains every crossover in manual control, rad/s.
pub const MANUAL_CONTROL_RANGE_RAD_S: (f64, f64) = (1e-3, 1e3);

/// A frequency at which the open loop crosses unit gain or the negative real axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Frequency of the crossing, rad/s.
    pub omega_rad_s: f64,
    /// Margin at this frequency: phase margin in deg at a crossing of unit gain, gain margin in dB at a crossing of the
    /// negative real axis.
    pub margin: f64,
}

/// All crossings of an open loop, in ascending order of frequency.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Crossings {
    /// Crossings of unit gain, each with its phase margin in deg, between -180 and 180.
    pub gain: Vec<Crossing>,
    /// Crossings of the negative real axis, each with its gain margin in dB.
    pub phase: Vec<Crossing>,
}

impl Crossings {
    /// Returns the phase margin and the gain margin nearest to zero; of equal margins, the one at the lowest frequency.
    pub fn margins(&self) -> Margins {
        let nearest = |of: &[Crossing]| {
            of.iter().copied().reduce(|held, next| {
                if next.margin.abs() < held.margin.abs() {
                    next
                } else {
                    held
                }
            })
        };
        let (phase, gain) = (nearest(&self.gain), nearest(&self.phase));
        Margins {
            crossover_rad_s: phase.map(|c| c.omega_rad_s),
            phase_margin_deg: phase.map(|c| c.margin),
            phase_crossover_rad_s: gain.map(|c| c.omega_rad_s),
            gain_margin_db: gain.map(|c| c.margin),
        }
    }
}

const POINTS_PER_DECADE: f64 = 100.0;
/// Largest accepted phase change between neighbouring points of the scan, rad.
pub(super) const MAX_TURN_RAD: f64 = 0.5;
/// Phase change between neighbouring points above which the direction of the change is uncertain, rad.
const MAX_CERTAIN_TURN_RAD: f64 = 2.0;
/// Maximum number of successive halvings of a step of the grid: the resulting 4096 points per step are enough to follow
/// a delay of 90 s at 1000 rad/s.
const MAX_HALVINGS: u32 = 12;
/// Returns the margins nearest to zero of any frequency response; the arguments are those of [`crossings`].
pub fn margins(open_loop: impl Fn(f64) -> Complex64, range_rad_s: (f64, f64)) -> Margins {
    crossings(open_loop, range_rad_s).margins()
}

/// Returns the crossings of any frequency response, continuous with delay or discrete. For a discrete response the
/// range ends at pi/Ts, where a response on the negative real axis counts as a phase crossover.
///
/// Returns no crossings if the range is not finite with `0 < low < high`. Frequencies at which the response is not
/// finite are skipped.
pub fn crossings(open_loop: impl Fn(f64) -> Complex64, range_rad_s: (f64, f64)) -> Crossings {
    let points = scan(&open_loop, range_rad_s);
    let mut found = Crossings::default();
    let phase_margin_deg = |l: Complex64| (-l).arg().to_degrees();
    let gain_margin_db = |l: Complex64| -20.0 * l.norm().log10();
    let crossing = |omega_rad_s: f64, margin: f64| Crossing { omega_rad_s, margin };

    for pair in points.windows(2) {
        let (low, high, l_low, l_high) = (pair[0].omega, pair[1].omega, pair[0].l, pair[1].l);
        if !(l_low.is_finite() && l_high.is_finite()) {
            continue;
        }
        let above = |l: Complex64| l.norm() >= 1.0;
        if above(l_low) != above(l_high) {
            let omega = bisect(low, high, |w| above(open_loop(w)) == above(l_low));
            found.gain.push(crossing(omega, phase_margin_deg(open_loop(omega))));
        }
        // Because the phase change between neighbouring points is small, a sign change of the imaginary part in the
        // left half plane is a crossing of the negative real axis.
        let upper = |l: Complex64| l.im >= 0.0;
        if upper(l_low) != upper(l_high) && l_low.re < 0.0 && l_high.re < 0.0 {
            let omega = bisect(low, high, |w| upper(open_loop(w)) == upper(l_low));
            found.phase.push(crossing(omega, gain_margin_db(open_loop(omega))));
        }
    }
    let on_negative_axis = |l: Complex64| l.re < 0.0 && l.im.abs() <= 1e-9 * l.re.abs();
    if let [.., before, end] = &points[..]
        && on_negative_axis(end.l)
        && !on_negative_axis(before.l)
    {
        found.phase.push(crossing(end.omega, gain_margin_db(end.l)));
    }
    found
}

/// Returns the total phase change of a response from the lower to the upper end of a range, in rad, and the response at
/// both ends. `None` if the response is not finite, or if its phase turns too fast to be followed.
pub(super) fn total_phase_change(
    of: impl Fn(f64) -> Complex64,
    range_rad_s: (f64, f64),
) -> Option<(f64, Complex64, Complex64)> {
    let points = scan(&of, range_rad_s);
    let (first, last) = (points.first()?.l, points.last()?.l);
    let mut turned = 0.0;
    for pair in points.windows(2) {
        let by = (pair[1].l * pair[0].l.conj()).arg();
        if !by.is_finite() || by.abs() > MAX_CERTAIN_TURN_RAD {
            return None;
        }
        turned += by;
    }
    Some((turned, first, last))
}

/// One point of the scan: a frequency, with the response and the slope of its phase.
#[derive(Clone, Copy)]
struct Point {
    omega: f64,
    l: Complex64,
    /// Slope of the phase, rad per rad/s.
    slope_s: f64,
}

impl Point {
    fn new(open_loop: &impl Fn(f64) -> Complex64, omega: f64) -> Self {
        let l = open_loop(omega);
        let step = 1e-6 * omega;
        let slope_s = (open_loop(omega - step).conj() * l).arg() / step;
        Self { omega, l, slope_s }
    }
}

/// Evaluates the response on a logarithmic grid that is refined to follow its phase.
fn scan(open_loop: &impl Fn(f64) -> Complex64, (low, high): (f64, f64)) -> Vec<Point> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let steps = (((high / low).log10() * POINTS_PER_DECADE).ceil() as usize).max(2);
    let ratio = (high / low).ln() / steps as f64;
    let mut points = vec![Point::new(open_loop, low)];
    for i in 1..=steps {
        let omega = if i == steps {
            high
        } else {
            low * (ratio * i as f64).exp()
        };
        let before = points[points.len() - 1];
        let next = Point::new(open_loop, omega);
        halve(open_loop, before, next, MAX_HALVINGS, &mut points);
    }
    points
}

/// Appends the point `high`, preceded by as many intermediate points as are needed to follow the phase from `low`.
fn halve(open_loop: &impl Fn(f64) -> Complex64, low: Point, high: Point, depth: u32, points: &mut Vec<Point>) {
    let turn = (high.l * low.l.conj()).arg().abs();
    let by_slope = low.slope_s.abs().max(high.slope_s.abs()) * (high.omega - low.omega);
    if depth > 0 && turn.max(by_slope) > MAX_TURN_RAD {
        let between = Point::new(open_loop, (low.omega * high.omega).sqrt());
        halve(open_loop, low, between, depth - 1, points);
        halve(open_loop, between, high, depth - 1, points);
    } else {
        points.push(high);
    }
}

/// Returns the frequency at which `holds` changes from true (at `low`) to false, up to rounding.
fn bisect(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low * high).sqrt()
}
