//! Design of the most informative forcing function.
//!
//! If the remnant is a share of the variance of u, the errors depend on how the power of u is distributed over the
//! lines, and not on its size (`information`). With the shares q of the lines in the response of u to the forcing
//! function, the information is `I = sum q_k M_k`. The requested quantities are parameters, the crossover or the
//! margin, with gradients g and accepted errors s. The design minimises `J = sum over wanted g' I^-1 g/s^2`, the sum of
//! the squared ratios of expected to accepted errors.
//!
//! The module `search` optimises the amplitudes and frequencies within their limits.

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::{
    DesignError, EntryPoint, Expected, Forcing, RUN_TO_RUN_DEVIATION, RequestedQuantity, Task,
    difference::check_spread,
    information::LoopQuantities,
    joint_coordinates::Quantity,
    lines::{are_separate_lines, crest_factor, multiples, set_phases},
    period_count,
    search::Search,
};

/// Options of the design of a forcing function.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignOptions {
    /// The requested quantities; if empty, all parameters, with errors relative to their values.
    pub requested_quantities: Vec<RequestedQuantity>,
    /// Period in s: the duration of a run divided by an integer.
    pub period_s: f64,
    /// Number of lines of each forcing function.
    pub lines: usize,
    /// Smallest distance between two lines, in multiples of the fundamental.
    pub spacing: u32,
    /// Lowest and highest frequency of the lines, rad/s.
    pub band_rad_s: (f64, f64),
    /// Largest amplitude of a line above the crossover frequency, relative to the geometric mean of the amplitudes of
    /// the lines below it.
    pub shelf: f64,
    /// Largest rms of e and of u; if neither is limited, the forcing function has an rms of one.
    pub max_rms: [Option<f64>; 2],
    /// Standard deviation of one person from run to run, relative to the quantity.
    pub run_to_run: f64,
    /// Seed of the search for phases. Different seeds give different phases of the same lines, so that people do not
    /// learn the signal.
    pub seed: u64,
}

impl Default for DesignOptions {
    fn default() -> Self {
        Self {
            requested_quantities: Vec::new(),
            period_s: 81.92,
            lines: 10,
            spacing: 3,
            band_rad_s: (0.2, 18.0),
            shelf: 0.2,
            max_rms: [None; 2],
            run_to_run: RUN_TO_RUN_DEVIATION,
            seed: 0,
        }
    }
}

/// Designed forcing functions with their expected errors.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignedForcing {
    /// Forcing function for each point of entry.
    pub forcing: Forcing,
    /// Ratio of peak to rms; of two forcing functions, the larger ratio.
    pub crest_factor: f64,
    /// Expected errors for one period.
    pub expected: Expected,
    /// Number of periods needed for the accepted errors of all requested quantities; at least one.
    pub periods: usize,
}

impl DesignOptions {
    /// Designs a forcing function for each point of entry.
    ///
    /// # Errors
    /// [`DesignError`] as for [`super::expected`], if a requested quantity does not exist, or if the band has no
    /// room for the lines.
    pub fn run(&self, task: &Task, points: &[EntryPoint]) -> Result<DesignedForcing, DesignError> {
        check_spread("spread from run to run", self.run_to_run)?;
        let [rms_e, rms_u] = self.max_rms.map(|most| most.unwrap_or(1.0));
        for (quantity, found) in [
            ("length of a run in s", self.period_s),
            ("largest rms of the error", rms_e),
            ("largest rms of the control", rms_u),
            ("number of lines", self.lines as f64),
        ] {
            if !(found.is_finite() && found > 0.0) {
                return Err(DesignError::OutOfRange {
                    quantity,
                    found,
                    expected: "a number above 0",
                });
            }
        }
        let least = (self.band_rad_s.0 * self.period_s / TAU).ceil();
        let largest = (self.band_rad_s.1 * self.period_s / TAU).floor();
        if !(least >= 1.0 && largest > least && largest < 1e5) {
            return Err(DesignError::OutOfRange {
                quantity: "highest frequency of the lines in whole periods of the forcing function",
                found: largest,
                expected: "more than that of the lowest line, which is at least 1, and less than 100000",
            });
        }
        let (least, largest) = (least as u32, largest as u32);
        let all = LoopQuantities::of(task)?;
        let search = Search {
            quantities: &all,
            gradients: self.gradients(&all)?,
            period_s: self.period_s,
            shelf: self.shelf,
        };
        let asked = self.lines * points.len();
        let found = multiples((least, largest), asked, self.spacing);
        if found.len() < asked {
            return Err(DesignError::NoRoom {
                requested_lines: asked,
                found: found.len(),
                spacing: self.spacing,
            });
        }
        let places = found.into_iter().zip(points.iter().cycle().copied()).collect();
        let (places, shares) = search.optimise_lines(places, |all, k, moved| {
            let others = all.iter().enumerate().filter(|(j, _)| *j != k);
            let mut others = others.map(|(_, (m, _))| *m);
            (least..=largest).contains(&moved) && others.all(|m| are_separate_lines(m, moved, self.spacing))
        })?;
        let mut lines = search.lines(&places, &shares);
        lines.sort_by(|(_, a), (_, b)| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        let of_one = all.expected(&Forcing::new(lines.clone())?, self.period_s)?;
        let limits = [of_one.rms_e, of_one.rms_u].into_iter().zip(self.max_rms);
        let scale = limits
            .filter_map(|(rms, most)| Some(most? / rms))
            .fold(f64::INFINITY, f64::min);
        if scale.is_finite() {
            lines.iter_mut().for_each(|(_, line)| line.amplitude_deg *= scale);
        }
        let mut crest = 0.0_f64;
        let forcing = Forcing::new(lines)?;
        let mut flat = Vec::new();
        for &enters in points {
            let mut own = forcing.sinusoids(enters);
            set_phases(&mut own, self.period_s, self.seed);
            crest = crest.max(crest_factor(&own, self.period_s));
            flat.extend(own.into_iter().map(|line| (enters, line)));
        }
        let forcing = Forcing::new(flat)?;
        let expected = all
            .expected(&forcing, self.period_s)?
            .with_run_to_run(self.run_to_run, 1);
        Ok(DesignedForcing {
            crest_factor: crest,
            periods: period_count(&expected, &self.requested_quantities),
            expected,
            forcing,
        })
    }

    /// Returns the gradients of the requested quantities, each divided by the accepted error.
    fn gradients(&self, all: &LoopQuantities<'_>) -> Result<Vec<DVector<f64>>, DesignError> {
        let known = all.quantities();
        let of = |wanted: &RequestedQuantity| {
            let found = known.iter().find(|q| q.name == wanted.name).ok_or_else(|| {
                let names: Vec<&str> = known.iter().map(|q| q.name).collect();
                DesignError::NotThere {
                    name: wanted.name.clone(),
                    expected: names.join(", "),
                }
            })?;
            if !(wanted.error.is_finite() && wanted.error > 0.0) {
                return Err(DesignError::OutOfRange {
                    quantity: "accepted error",
                    found: wanted.error,
                    expected: "a positive number",
                });
            }
            Ok(&found.gradient / (found.scale * wanted.error))
        };
        if self.requested_quantities.is_empty() {
            let is_parameter = |q: &&Quantity| !matches!(q.name, "crossover" | "phase_margin");
            let parameters = known.iter().filter(is_parameter);
            return Ok(parameters.map(|q| &q.gradient / q.size).collect());
        }
        self.requested_quantities.iter().map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_numerics::statistics::mean;

    use super::{
        super::information::tests::{reference, task},
        *,
    };

    #[test]
    fn design_is_more_informative_than_the_thesis_lines() {
        let task = task(0.2);
        let designed = DesignOptions::default().run(&task, &[EntryPoint::Target]).unwrap();
        let text = super::super::expected(&task, &reference(), 81.92).unwrap();
        let sum = |of: &Expected| -> f64 {
            of.parameters()
                .map(|q| (q.estimate.standard_error.unwrap() / q.estimate.value).powi(2))
                .sum()
        };
        println!(
            "J {} for {}, crest factor {}",
            sum(&designed.expected),
            sum(&text),
            designed.crest_factor
        );
        assert!(sum(&designed.expected) < 0.7 * sum(&text));
        assert!(designed.crest_factor < 2.5 && designed.periods == 1);
        assert!((designed.forcing.function(EntryPoint::Target).unwrap().rms_deg() - 1.0).abs() < 1e-9);
        assert_eq!(
            designed,
            DesignOptions::default().run(&task, &[EntryPoint::Target]).unwrap()
        );
        // The lines above the crossover frequency form the shelf, and no line dominates.
        let crossover = designed.expected.estimate("crossover").unwrap().value;
        let amplitudes = |beyond: bool| -> Vec<f64> {
            let all = designed.forcing.sinusoids(EntryPoint::Target).into_iter();
            let of = all.filter(|l| (l.omega_rad_s > crossover) == beyond);
            of.map(|l| l.amplitude_deg).collect()
        };
        let below = amplitudes(false);
        let level = mean(&below.iter().map(|a| a.ln()).collect::<Vec<_>>()).exp();
        assert!(
            amplitudes(true).iter().all(|a| *a < 0.25 * level),
            "{:?}",
            designed.forcing
        );
        assert!(
            below.iter().all(|a| (0.4 * level..2.5 * level).contains(a)),
            "{:?}",
            designed.forcing
        );
    }

    #[test]
    fn requested_quantities_are_estimated_more_precisely() {
        let task = task(0.2);
        let of = |name: &str| {
            let wanted = vec![RequestedQuantity {
                name: name.to_owned(),
                error: 0.02,
            }];
            let designed = DesignOptions {
                requested_quantities: wanted,
                ..DesignOptions::default()
            }
            .run(&task, &[EntryPoint::Target])
            .unwrap();
            let error = |name: &str| designed.expected.error(name).unwrap();
            assert_eq!(designed.periods, (error(name) / 0.02).powi(2).ceil().max(1.0) as usize);
            [error("crossover"), error("omega_nm")]
        };
        let (crossover, omega) = (of("crossover"), of("omega_nm"));
        assert!(
            crossover[0] < omega[0] && omega[1] < crossover[1],
            "{crossover:?} {omega:?}"
        );
        let wanted = vec![RequestedQuantity {
            name: "T_I".to_owned(),
            error: 0.1,
        }];
        let error = DesignOptions {
            requested_quantities: wanted,
            ..DesignOptions::default()
        }
        .run(&task, &[EntryPoint::Target])
        .unwrap_err();
        assert!(error.to_string().contains("crossover, phase_margin"), "{error}");
    }

    #[test]
    fn rms_limits_are_respected() {
        let task = task(0.2);
        let of = |most_rms| {
            DesignOptions {
                max_rms: most_rms,
                ..DesignOptions::default()
            }
            .run(&task, &[EntryPoint::Target])
            .unwrap()
            .expected
        };
        let small = of([Some(0.5), Some(100.0)]);
        assert!((small.rms_e - 0.5).abs() < 1e-9 && small.rms_u < 100.0);
        let weak = of([None, Some(0.1)]);
        assert!((weak.rms_u - 0.1).abs() < 1e-9);
        let error = DesignOptions {
            band_rad_s: (3.0, 2.0),
            ..DesignOptions::default()
        }
        .run(&task, &[EntryPoint::Target])
        .unwrap_err();
        assert!(matches!(error, DesignError::OutOfRange { .. }));
        assert!(matches!(
            DesignOptions {
                lines: 1,
                ..DesignOptions::default()
            }
            .run(&task, &[EntryPoint::Target]),
            Err(DesignError::NotIdentifiable { .. })
        ));
    }
}
