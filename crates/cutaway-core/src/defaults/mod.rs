//! Choices for an image that nobody stated: the range of values that is shown and the view; and the reason for an image that
//! shows nothing.
//!
//! Input: a volume and what was stated about it. Output: ranges that a few outliers do not move ([`robust_range`]), a
//! camera that frames what can be seen ([`default_view`]), and an [`EmptyCause`].

mod empty;
mod range;
mod view;
mod visible;

pub use empty::{EmptyCause, empty_cause};
pub use range::{OUTLIERS, display_range, robust_range};
pub use view::{FramedView, UnknownView, View, default_view};
pub use visible::Look;
