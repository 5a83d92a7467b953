//! A layer of a scene: data, and how its values look.

use super::checks::{SceneError, setting, validate_lighting};
use super::data::Data;
use super::defaults::default_unit_distance;
use crate::lighting::Lighting;
use crate::transfer_function::TransferFunction;

/// Data with the colours, opacities and material that they are shown with.
#[derive(Clone, Debug)]
pub struct Layer {
    data: Data,
    transfer_function: TransferFunction,
    unit_distance: f64,
    lighting: Lighting,
}

impl Layer {
    /// Returns a layer with default light, whose opacities are per mean voxel spacing.
    pub fn new(data: impl Into<Data>, transfer_function: &TransferFunction) -> Self {
        let data = data.into();
        let unit_distance = default_unit_distance(data.lattice());
        let (transfer_function, lighting) = (transfer_function.clone(), Lighting::default());
        Self { data, transfer_function, unit_distance, lighting }
    }

    /// Sets the length in world units that opacities are for; none: the mean voxel spacing.
    #[must_use]
    pub fn with_unit_distance(mut self, unit_distance: Option<f64>) -> Self {
        self.unit_distance = unit_distance.unwrap_or_else(|| default_unit_distance(self.data.lattice()));
        self
    }

    /// Sets light and material.
    #[must_use]
    pub fn with_lighting(mut self, lighting: Lighting) -> Self {
        self.lighting = lighting;
        self
    }

    /// The data.
    pub fn data(&self) -> &Data {
        &self.data
    }

    /// The transfer function.
    pub fn transfer_function(&self) -> &TransferFunction {
        &self.transfer_function
    }

    /// The length in world units that opacities are for.
    pub fn unit_distance(&self) -> f64 {
        self.unit_distance
    }

    /// Light and material.
    pub fn lighting(&self) -> &Lighting {
        &self.lighting
    }

    pub(super) fn brightened(mut self, brightness: f64) -> Self {
        self.transfer_function = self.transfer_function.with_brightness(brightness);
        self
    }

    pub(super) fn validate(&self) -> Result<(), SceneError> {
        let dimensions = self.data.lattice().dimensions();
        if dimensions.min_element() < 2 {
            return Err(SceneError::Flat { dimensions: dimensions.to_array() });
        }
        let unit = self.unit_distance;
        if !(1e-30..=1e30).contains(&unit) {
            return Err(setting(
                "unit_distance",
                crate::numbers::exact(unit),
                "a length above 0, of 1e-30 to 1e30",
            ));
        }
        validate_lighting(&self.lighting)
    }
}
