//! Method and limits of a search.

/// Method of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SearchMethod {
    /// Levenberg-Marquardt, along the border of stability if necessary.
    #[default]
    Automatic,
    /// Gauss-Newton with halved steps.
    GaussNewton,
    /// Levenberg-Marquardt.
    LevenbergMarquardt,
    /// Steepest descent, scaled by the diagonal of the Gauss-Newton matrix.
    SteepestDescent,
}

hoid_model::named_choice!(SearchMethod, "search method", 4, {
    Automatic => "auto", GaussNewton => "gn", LevenbergMarquardt => "lm", SteepestDescent => "grad",
});

/// Method and limits of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Method of a step. Default automatic.
    pub method: SearchMethod,
    /// Largest number of steps from each start. Default 100.
    pub max_iterations: usize,
    /// Relative decrease of the loss for convergence. Default 1e-12.
    pub tolerance: f64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
            method: SearchMethod::Automatic,
            max_iterations: 100,
            tolerance: 1e-12,
        }
    }
}
