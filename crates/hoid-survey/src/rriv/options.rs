//! Options of the recursive refined instrumental variable method, its description, and its construction.

use hoid_ident::{IdentError, iv::FORCING_CHANNEL, settings};
use hoid_model::{Record, SampleTime, Structure};

use super::{RefinedRecursion, RefinedStart};
use hoid_track::{
    Memory, MemoryOptions,
    building::{MethodDescription, Recursion, RecursiveMethod, Setup, StartState, invalid_option, short_memory_for_b},
};

settings! {
    /// Options of the recursive refined instrumental variable method.
    pub struct RrivOptions {
        /// Channel from outside the loop that provides the instruments
        #[setting(default("f_t if the record has it, else e"))]
        pub instruments: Option<String> = None,
    }
    groups {
        /// Memory lengths of the parameters.
        pub memories: MemoryOptions,
    }
}

impl RecursiveMethod for RrivOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "rriv",
            help: "recursive refined instrumental variable",
            source: "Young 2011, chapters 7 and 8; Young 2015",
            structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
            defaults: &[("memory", "2.56s for b, 20.48s for the others")],
        }
    }

    fn default_memory(&self, parameter: &str) -> Memory {
        short_memory_for_b(parameter)
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        let o = &setup.orders;
        if o.na == 0 && o.nc == 0 && o.nb > 0 && o.nf > 0 {
            return Ok(());
        }
        Err(invalid_option(
            "the structure of rriv",
            format!("{} with {o}", setup.structure),
            "bj with nc = 0, or oe",
        ))
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        if !from.from_fit {
            return Err(IdentError::BadStart {
                reason: "rriv needs a model for its instruments; start it from the batch fit of a span".to_owned(),
            });
        }
        let covariance: Vec<f64> = from.spread.iter().map(|s| s * from.variance).collect();
        let start = RefinedStart {
            theta: &from.values,
            covariance: &covariance,
            innovation_variance: from.variance,
            samples: from.residuals as usize,
        };
        let lambda = setup
            .memories
            .iter()
            .map(|(_, memory)| memory.lambda(sample_time))
            .collect::<Result<Vec<f64>, _>>()?;
        Ok(Box::new(RefinedRecursion::new(
            setup.orders,
            start,
            &lambda,
            self.instruments.is_some(),
        )?))
    }

    fn memories(&self) -> Option<&MemoryOptions> {
        Some(&self.memories)
    }

    fn reference_channel(&self) -> Option<&str> {
        self.instruments.as_deref()
    }

    fn prepare(&mut self, record: &Record) {
        if self.instruments.is_none() && record.channel(FORCING_CHANNEL).is_some() {
            self.instruments = Some(FORCING_CHANNEL.to_owned());
        }
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.memories.memory_of.retain(|key, _| known(key));
    }
}
