//! Coefficients by name, for all model structures. The poles of the operator are in A of an ARX model and in F of a
//! Box-Jenkins model.

use hoid_ident::Fit;
use hoid_track::Trace;

/// A coefficient of a polynomial, such as b0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Coefficient {
    /// Letter of the polynomial in lower case.
    pub letter: char,
    /// Index of the coefficient in its polynomial.
    pub index: usize,
}

impl Coefficient {
    /// Parses the name of a coefficient.
    pub fn parse(name: &str) -> Option<Self> {
        let mut letters = name.chars();
        let letter = letters.next()?;
        let index = letters.as_str().parse().ok()?;
        Some(Self { letter, index })
    }

    /// The coefficient in whose panel this coefficient is drawn: if `joined` is true, f1 is drawn in the panel of a1.
    pub fn panel_coefficient(self, joined: bool) -> Self {
        match self.letter {
            'f' if joined => Self { letter: 'a', ..self },
            _ => self,
        }
    }

    /// Name of the panel of the coefficient.
    pub fn panel_name(self, joined: bool) -> String {
        let index = self.index;
        match self.letter {
            'a' if joined => format!("a{index}, f{index}"),
            letter => format!("{letter}{index}"),
        }
    }
}

/// The coefficients of a trace, in the order of theta.
pub fn trace_coefficients(trace: &Trace) -> Vec<Coefficient> {
    trace
        .parameter_names()
        .iter()
        .filter_map(|n| Coefficient::parse(n))
        .collect()
}

/// The coefficients of a fit, in the order of theta; empty for a grey-box model, whose parameters are not coefficients.
pub fn fit_coefficients(fit: &Fit) -> Vec<Coefficient> {
    if fit.is_grey_box() {
        return Vec::new();
    }
    fit.parameters()
        .iter()
        .filter_map(|(n, _)| Coefficient::parse(n))
        .collect()
}

/// True if some traces have their poles in A and others in F; a1 and f1 are then the same quantity.
pub fn must_join_poles(traces: &[&Trace]) -> bool {
    let orders = |t: &&&Trace| t.options().orders;
    traces.iter().any(|t| orders(&t).na > 0 && orders(&t).nf == 0)
        && traces.iter().any(|t| orders(&t).nf > 0 && orders(&t).na == 0)
        && !traces.iter().any(|t| orders(&t).nf > 0 && orders(&t).na > 0)
}
