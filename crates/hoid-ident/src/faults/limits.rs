//! Limits that are used in several files of this folder.

/// Longest fault that is bridged, s.
pub const MAX_BRIDGED_S: f64 = 0.1;
/// Shortest segment between two cuts that is used, s.
pub const MIN_SEGMENT_S: f64 = 2.0;
/// Share of spikes in a channel above which no spike is bridged.
pub const MAX_SPIKE_SHARE: f64 = 0.05;
