//! Positions of the physical parameters of each record in eta, and the resulting polynomials.
//!
//! Slots of one record: `[K_e, K_e_dot (or T_L), omega_nm, zeta_nm, tau_e, T_n]`; the last slot exists only for m > 0.
//! A parameter common to all records has one element in eta; an individual parameter has one element for each record.
//! The lead is described by K_e_dot unless the user constrains T_L or makes it individual: `K_e_dot = K_e T_L` is well
//! determined even if K_e is small.

use std::{collections::BTreeMap, ops::Range};

use hoid_model::{
    ModelError, Orders, SampleTime,
    delayed_operator::{delayed_operator_and_jacobian_with_delay_samples, whole_samples},
    remnant_noise::remnant_noise,
};

use super::parametrisation::{DelayIntervals, MappedPolynomials, Parametrisation};
use crate::{Constraint, IdentError};

/// Number of slots of a model with a remnant filter.
pub(crate) const SLOT_COUNT: usize = 6;
/// Slot of the lead: K_e_dot or T_L.
pub(crate) const LEAD_SLOT: usize = 1;
/// Slot of the delay.
pub(crate) const DELAY_SLOT: usize = 4;
/// Slot of the remnant's time constant.
pub(crate) const TIME_CONSTANT_SLOT: usize = 5;

/// Names of the parameters that can be constrained or estimated individually for each record.
pub const GREY_BOX_PARAMETER_NAMES: [&str; 7] = ["K_e", "K_e_dot", "T_L", "omega_nm", "zeta_nm", "tau_e", "T_n"];

/// Bounds of zeta_nm: almost no damping at the lower bound, two effectively independent poles at the upper bound.
const ZETA_LIMITS: (f64, f64) = (1e-4, 20.0);
/// Bounds of T_n in samples: below the lower bound the remnant is white noise, above the upper bound it is a drift.
const TIME_CONSTANT_LIMITS: (f64, f64) = (0.1, 1e4);
/// Largest omega_nm as a share of pi/Ts.
const MAX_NYQUIST_SHARE: f64 = 0.999;

/// Coordinate that describes the lead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Lead {
    /// The coordinate is K_e_dot in s.
    RateGain,
    /// The coordinate is T_L in s.
    Time,
}

/// Parameters with their validated constraints.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Layout {
    /// Order m of the remnant filter.
    pub order: usize,
    pub lead: Lead,
    pub sample_time: SampleTime,
    /// Index in eta of each slot, for each record.
    pub positions: Vec<[usize; SLOT_COUNT]>,
    /// Name of each element of eta; the name of an individual parameter contains the number of its record.
    pub names: Vec<String>,
    /// Bounds of each element of eta.
    pub limits: Vec<(f64, f64)>,
    /// Slot of each element of eta.
    pub slots: Vec<usize>,
}

/// Orders and theta of one record for a given eta. The Jacobian has a row for each coefficient and a column for each
/// slot.
#[derive(Debug, Clone)]
pub(crate) struct Polynomials {
    pub orders: Orders,
    pub theta: Vec<f64>,
    pub jacobian: Vec<[f64; SLOT_COUNT]>,
}

/// Returns the orders of the Box-Jenkins model that contains the grey box as a special case.
pub(crate) fn orders(order: usize, nk: usize) -> Orders {
    Orders {
        na: 0,
        nb: 3,
        nc: order.saturating_sub(1),
        nd: order,
        nf: 2,
        nk,
    }
}

impl Layout {
    pub fn new(
        order: usize,
        records: usize,
        delay_range_s: (f64, f64),
        constraints: &BTreeMap<String, Constraint>,
        individual: &[String],
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        for name in constraints.keys().chain(individual) {
            if !GREY_BOX_PARAMETER_NAMES.contains(&name.as_str()) {
                return Err(IdentError::UnknownParameter {
                    name: name.clone(),
                    available: GREY_BOX_PARAMETER_NAMES.join(", "),
                });
            }
        }
        let asked = |name: &str| constraints.contains_key(name) || individual.iter().any(|n| n == name);
        if constraints.contains_key("T_L") && asked("K_e_dot") {
            return Err(constraint_error(
                "T_L",
                "a constraint on K_e_dot = K_e T_L as well",
                "one of the two constraints".to_owned(),
            ));
        }
        let lead = if asked("T_L") { Lead::Time } else { Lead::RateGain };
        let mut layout = Self {
            order,
            lead,
            sample_time,
            positions: vec![[usize::MAX; SLOT_COUNT]; records],
            names: Vec::new(),
            limits: Vec::new(),
            slots: Vec::new(),
        };
        for (slot, name) in layout.slot_names().into_iter().enumerate() {
            let limits = layout.slot_limits(slot, name, delay_range_s, constraints)?;
            let own = individual.iter().any(|n| n == name) && records > 1;
            let copies = if own { records } else { 1 };
            for copy in 0..copies {
                for (record, positions) in layout.positions.iter_mut().enumerate() {
                    if !own || record == copy {
                        positions[slot] = layout.names.len();
                    }
                }
                layout.names.push(if own {
                    format!("{name}[{}]", copy + 1)
                } else {
                    name.to_owned()
                });
                layout.limits.push(limits);
                layout.slots.push(slot);
            }
        }
        Ok(layout)
    }

    fn slot_names(&self) -> Vec<&'static str> {
        let lead = match self.lead {
            Lead::RateGain => "K_e_dot",
            Lead::Time => "T_L",
        };
        let mut names = vec!["K_e", lead, "omega_nm", "zeta_nm", "tau_e"];
        if self.order > 0 {
            names.push("T_n");
        }
        names
    }

    /// Returns the bounds of a parameter: its constraint, limited to the admissible range.
    fn slot_limits(
        &self,
        slot: usize,
        name: &str,
        delay_range_s: (f64, f64),
        constraints: &BTreeMap<String, Constraint>,
    ) -> Result<(f64, f64), IdentError> {
        let ts = self.sample_time.s();
        let widest = match slot {
            2 => (1e-3, MAX_NYQUIST_SHARE * self.sample_time.nyquist_rad_s()),
            3 => ZETA_LIMITS,
            DELAY_SLOT => (0.0, f64::INFINITY),
            TIME_CONSTANT_SLOT => (TIME_CONSTANT_LIMITS.0 * ts, TIME_CONSTANT_LIMITS.1 * ts),
            _ => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let range = Constraint::Between(delay_range_s.0, delay_range_s.1);
        let constraint = match constraints.get(name) {
            Some(constraint) => *constraint,
            None if slot == DELAY_SLOT => range,
            None => Constraint::Between(widest.0, widest.1),
        };
        let (low, high) = constraint.limits();
        let within = (low.max(widest.0), high.min(widest.1));
        let meaning = within.0 <= within.1 && within.0 < f64::INFINITY && within.1 > f64::NEG_INFINITY;
        let fixed_elsewhere = low == high && within != (low, high);
        if !constraint.is_valid() || !meaning || fixed_elsewhere {
            let expected = format!(
                "a finite value, or a lower and an upper bound, within {:.6} to {:.6}",
                widest.0, widest.1
            );
            return Err(constraint_error(name, &format!("{constraint:?}"), expected));
        }
        if slot == DELAY_SLOT && !within.1.is_finite() {
            return Err(constraint_error(
                name,
                &format!("{constraint:?}"),
                "a finite upper bound: the longest delay".to_owned(),
            ));
        }
        Ok(within)
    }

    /// Returns the number of parameters of one record.
    pub fn used_slot_count(&self) -> usize {
        if self.order == 0 {
            TIME_CONSTANT_SLOT
        } else {
            SLOT_COUNT
        }
    }

    /// Returns nk for the longest possible delay.
    pub fn longest_nk(&self) -> Result<usize, ModelError> {
        let longest = self
            .delay_indices()
            .into_iter()
            .map(|i| self.limits[i].1)
            .fold(0.0, f64::max);
        Ok(whole_samples(longest, self.sample_time)? + 1)
    }

    /// Returns the eta in which every record has these parameters.
    pub fn common_eta(&self, slots: &[f64; SLOT_COUNT]) -> Vec<f64> {
        self.slots.iter().map(|&slot| slots[slot]).collect()
    }

    /// Returns the parameters of one record; T_n is 0 for a model without T_n.
    pub fn record_slots(&self, eta: &[f64], record: usize) -> [f64; SLOT_COUNT] {
        let mut values = [0.0; SLOT_COUNT];
        for (value, &position) in values
            .iter_mut()
            .zip(&self.positions[record])
            .take(self.used_slot_count())
        {
            *value = eta[position];
        }
        values
    }

    /// Returns `[K_e, K_e_dot, omega_nm, zeta_nm, tau_e]` from the slots of one record.
    pub fn operator(&self, slots: &[f64; SLOT_COUNT]) -> [f64; 5] {
        let [k_e, lead, omega, zeta, tau, _] = *slots;
        let k_e_dot = match self.lead {
            Lead::RateGain => lead,
            Lead::Time => k_e * lead,
        };
        [k_e, k_e_dot, omega, zeta, tau]
    }

    /// Returns the polynomials of one record. `sample` is the sampling interval that contains tau_e, if the caller has
    /// chosen one.
    pub fn polynomials(&self, eta: &[f64], record: usize, sample: Option<usize>) -> Result<Polynomials, ModelError> {
        let slots = self.record_slots(eta, record);
        let operator = self.operator(&slots);
        let sample = match sample {
            Some(sample) => sample,
            None => whole_samples(operator[DELAY_SLOT], self.sample_time)?,
        };
        let (held, by_operator) = delayed_operator_and_jacobian_with_delay_samples(sample, operator, self.sample_time)?;
        let noise = remnant_noise(slots[TIME_CONSTANT_SLOT], self.order, self.sample_time)?;
        let mut theta = held.b.to_vec();
        theta.extend_from_slice(&noise.c);
        theta.extend_from_slice(&noise.d);
        theta.extend_from_slice(&held.f);
        let row_of_operator = |row: [f64; 5]| {
            let [k_e, k_e_dot, omega, zeta, tau] = row;
            match self.lead {
                Lead::RateGain => [k_e, k_e_dot, omega, zeta, tau, 0.0],
                Lead::Time => [
                    k_e + slots[LEAD_SLOT] * k_e_dot,
                    slots[0] * k_e_dot,
                    omega,
                    zeta,
                    tau,
                    0.0,
                ],
            }
        };
        let mut jacobian: Vec<[f64; SLOT_COUNT]> = by_operator[..3].iter().map(|r| row_of_operator(*r)).collect();
        jacobian.extend(
            noise
                .c_slope
                .iter()
                .chain(&noise.d_slope)
                .map(|s| [0.0, 0.0, 0.0, 0.0, 0.0, *s]),
        );
        jacobian.extend(by_operator[3..].iter().map(|r| row_of_operator(*r)));
        Ok(Polynomials {
            orders: orders(self.order, held.nk),
            theta,
            jacobian,
        })
    }
}

impl Parametrisation for Layout {
    fn positions(&self, record: usize) -> &[usize] {
        &self.positions[record][..self.used_slot_count()]
    }

    fn limits(&self) -> &[(f64, f64)] {
        &self.limits
    }

    fn delay_indices(&self) -> Vec<usize> {
        (0..self.slots.len()).filter(|&i| self.slots[i] == DELAY_SLOT).collect()
    }

    fn delay_index(&self, record: usize) -> usize {
        self.positions[record][DELAY_SLOT]
    }

    fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    fn orders(&self, nk: usize) -> Orders {
        orders(self.order, nk)
    }

    fn stable_blocks(&self) -> Vec<Range<usize>> {
        Vec::new()
    }

    fn map(&self, eta: &[f64], record: usize, held: DelayIntervals<'_>) -> Result<MappedPolynomials, ModelError> {
        let sample = held.sampling_interval(self.delay_index(record));
        let Polynomials {
            orders,
            theta,
            jacobian,
        } = self.polynomials(eta, record, sample)?;
        let column = |slot: usize| -> Vec<f64> { jacobian.iter().map(|row| row[slot]).collect() };
        let columns = (0..self.used_slot_count()).map(column).collect();
        Ok(MappedPolynomials {
            orders,
            further: Vec::new(),
            theta,
            columns,
        })
    }
}

fn constraint_error(name: &str, found: &str, expected: String) -> IdentError {
    IdentError::BadOption {
        option: format!("the constraint on {name}"),
        found: found.to_owned(),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(
        order: usize,
        records: usize,
        constraints: &[(&str, Constraint)],
        individual: &[&str],
    ) -> Result<Layout, IdentError> {
        let constraints = constraints.iter().map(|(n, c)| ((*n).to_owned(), *c)).collect();
        let individual: Vec<String> = individual.iter().map(|n| (*n).to_owned()).collect();
        Layout::new(
            order,
            records,
            (0.05, 0.6),
            &constraints,
            &individual,
            SampleTime::AT_100_HZ,
        )
    }

    #[test]
    fn common_and_individual_parameters_have_distinct_positions() {
        let common = layout(2, 3, &[], &[]).unwrap();
        assert_eq!(common.names, ["K_e", "K_e_dot", "omega_nm", "zeta_nm", "tau_e", "T_n"]);
        assert!(common.positions.iter().all(|p| *p == [0, 1, 2, 3, 4, 5]));
        let mixed = layout(0, 2, &[], &["K_e", "tau_e"]).unwrap();
        assert_eq!(
            mixed.names,
            [
                "K_e[1]", "K_e[2]", "K_e_dot", "omega_nm", "zeta_nm", "tau_e[1]", "tau_e[2]"
            ]
        );
        assert_eq!(mixed.delay_indices(), [5, 6]);
        let eta = [1.0, 2.0, 3.0, 4.0, 5.0, 0.1, 0.2];
        assert_eq!(mixed.record_slots(&eta, 1), [2.0, 3.0, 4.0, 5.0, 0.2, 0.0]);
        assert_eq!(mixed.longest_nk().unwrap(), 61);
        // With one record, no parameter is individual.
        assert_eq!(layout(1, 1, &[], &["K_e"]).unwrap().names[0], "K_e");
    }

    #[test]
    fn jacobian_agrees_with_finite_differences() {
        for constraint in ["K_e", "T_L"] {
            for order in 0..=4 {
                let open = Constraint::Between(f64::NEG_INFINITY, f64::INFINITY);
                let layout = layout(order, 1, &[(constraint, open)], &[]).unwrap();
                let eta = [0.09, 0.4, 11.25, 0.35, 0.2837, 0.06];
                let eta = &eta[..layout.names.len()];
                let exact = layout.polynomials(eta, 0, None).unwrap();
                for j in 0..eta.len() {
                    let h = 1e-5 * eta[j];
                    let at = |sign: f64| {
                        let mut moved = eta.to_vec();
                        moved[j] += sign * h;
                        layout.polynomials(&moved, 0, None).unwrap().theta
                    };
                    let (up, down) = (at(1.0), at(-1.0));
                    let scale = exact.jacobian.iter().map(|r| r[j].abs()).fold(0.0, f64::max);
                    for i in 0..up.len() {
                        let difference = (up[i] - down[i]) / (2.0 * h);
                        // The difference has a truncation error of order h^2 and a rounding error of eps/h.
                        assert!(
                            (exact.jacobian[i][j] - difference).abs() < 1e-7 * scale,
                            "m {order} {constraint} row {i} column {j}: {} and {difference}",
                            exact.jacobian[i][j]
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn invalid_constraints_are_refused_by_name() {
        let name = |r: Result<Layout, IdentError>| match r {
            Err(IdentError::BadOption { option, .. }) => option.replace("the constraint on ", ""),
            Err(IdentError::UnknownParameter { name, .. }) => name,
            other => panic!("expected a refusal, found {other:?}"),
        };
        assert_eq!(name(layout(1, 1, &[("K_n", Constraint::Fixed(1.0))], &[])), "K_n");
        assert_eq!(name(layout(1, 1, &[], &["sigma"])), "sigma");
        let both = [("T_L", Constraint::Fixed(0.4)), ("K_e_dot", Constraint::Fixed(0.03))];
        assert_eq!(name(layout(1, 1, &both, &[])), "T_L");
        assert_eq!(name(layout(1, 1, &[("tau_e", Constraint::Fixed(-0.1))], &[])), "tau_e");
        assert_eq!(
            name(layout(1, 1, &[("omega_nm", Constraint::Between(400.0, 500.0))], &[])),
            "omega_nm"
        );
        assert_eq!(
            name(layout(1, 1, &[("tau_e", Constraint::Between(0.1, f64::INFINITY))], &[])),
            "tau_e"
        );
        let fixed = layout(1, 1, &[("zeta_nm", Constraint::Fixed(0.3))], &[]).unwrap();
        assert_eq!(fixed.limits[3], (0.3, 0.3));
    }
}
