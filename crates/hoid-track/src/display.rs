//! Options as text, for results and reports.

use hoid_model::SampleTime;

use crate::{
    forgetting::ForgettingRule, memory::Memory, options::TrackOptions, setup::StartSource, shared_options::WindupGuard,
};

impl TrackOptions {
    /// Returns the forgetting rule and the memory of the recursion as text.
    pub fn memory_as_text(&self, sample_time: SampleTime) -> String {
        let method = &self.method;
        if let Some(words) = method.memory_as_text() {
            return words;
        }
        let memories = || self.memories_as_text(sample_time);
        match method.forgetting() {
            ForgettingRule::Exponential => {
                let unbounded = match method.windup_guard(self.structure) {
                    Some(WindupGuard::Off) => ", P without a windup guard",
                    _ => "",
                };
                format!("exponential forgetting, memory {}{unbounded}", memories())
            }
            ForgettingRule::RandomWalk(drift) => {
                let each: Vec<String> = drift.iter().map(|(name, d)| format!("{name} {d}")).collect();
                format!("random walk, drift in one second: {}", each.join(", "))
            }
            ForgettingRule::Window => format!("sliding window of the shortest memory, {}", memories()),
            ForgettingRule::Variable => format!("variable forgetting with the shortest memory, {}", memories()),
            ForgettingRule::Directional => format!("directional forgetting with the shortest memory, {}", memories()),
            ForgettingRule::Gradient(rate) => format!("none: normalised gradient of rate {rate}"),
        }
    }

    /// Lists each memory length once, with the parameters that have it.
    fn memories_as_text(&self, sample_time: SampleTime) -> String {
        let mut groups: Vec<(Memory, Vec<String>)> = Vec::new();
        for (name, memory) in self
            .parameter_names()
            .into_iter()
            .zip(self.memories().unwrap_or_default())
        {
            match groups.iter_mut().find(|(known, _)| *known == memory) {
                Some((_, names)) => names.push(name),
                None => groups.push((memory, vec![name])),
            }
        }
        if let [(memory, _)] = groups.as_slice() {
            return memory.as_text(sample_time);
        }
        let of =
            |(memory, names): &(Memory, Vec<String>)| format!("{} {}", names.join(" "), memory.as_text(sample_time));
        groups.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    /// Returns the start of the recursion as text.
    pub fn start_as_text(&self) -> String {
        if let Some(prior) = self.method.person_prior() {
            return prior.as_text();
        }
        let covariance = match self.method.initial_covariance() {
            None => "its covariance".to_owned(),
            Some(p) => format!("P = {p} I"),
        };
        match &self.start {
            StartSource::Span(Some((from, to))) => format!("batch fit of {from:.2} to {to:.2} s, {covariance}"),
            StartSource::Span(None) => format!("batch fit of the first third, {covariance}"),
            StartSource::Theta(_) => "from the given coefficients".to_owned(),
            StartSource::Nothing => "from nothing".to_owned(),
        }
    }
}

impl Memory {
    /// Returns the memory with its unit, in samples and seconds.
    pub fn as_text(self, sample_time: SampleTime) -> String {
        let ts = sample_time.s();
        let round = |v: f64| (v * 1e6).round() / 1e6;
        match self {
            Self::Samples(n) => format!("{} samples ({} s)", round(n), round(n * ts)),
            Self::Seconds(s) => format!("{s} s ({} samples)", round(s / ts)),
            Self::Infinite => "infinite".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::Method;

    #[test]
    fn every_method_describes_its_memory() {
        let ts = SampleTime::AT_100_HZ;
        for method in [Method::rls(), Method::rpem(), Method::adaptive()] {
            let (structure, orders) = (method.default_structure(), method.default_orders(29));
            assert!(
                !TrackOptions::new(method, structure, orders)
                    .memory_as_text(ts)
                    .is_empty()
            );
        }
        let of = |settings: &[(&str, &str)]| {
            let rls = Method::rls();
            let (structure, orders) = (rls.default_structure(), rls.default_orders(29));
            let options = TrackOptions::new(rls, structure, orders).with(settings).unwrap();
            options.memory_as_text(ts)
        };
        assert_eq!(of(&[]), "exponential forgetting, memory 2.56 s (256 samples)");
        assert_eq!(
            of(&[("memory_of", "b=inf")]),
            "exponential forgetting, memory a1 a2 2.56 s (256 samples), b0 b1 infinite"
        );
        assert_eq!(
            of(&[("covariance", "0.1")]),
            "exponential forgetting, memory 2.56 s (256 samples), P without a windup guard"
        );
        assert!(of(&[("forgetting", "gradient")]).ends_with("rate 0.1"));
    }
}
