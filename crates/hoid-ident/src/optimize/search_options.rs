//! Method and limits of a search.

/// Method for the steps of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SearchMethod {
    /// Levenberg-Marquardt, continued along the border of stability if necessary.
    #[default]
    Automatic,
    /// Gauss-Newton with step halving.
    GaussNewton,
    /// Levenberg-Marquardt.
    LevenbergMarquardt,
    /// Steepest descent, scaled by the diagonal of the Gauss-Newton matrix.
    SteepestDescent,
}

hoid_model::named_choice!(SearchMethod, "search method", 4, {
    Automatic => "auto", GaussNewton => "gn", LevenbergMarquardt => "lm", SteepestDescent => "grad",
});

/// Method and limits of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Method for the steps. Default automatic.
    pub method: SearchMethod,
    /// Largest number of steps from each start. Default 100.
    pub max_iterations: usize,
    /// Predicted relative decrease in the loss below which the search has converged. Default 1e-12.
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
