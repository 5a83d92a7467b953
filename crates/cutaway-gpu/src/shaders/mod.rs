//! The one way from a `.wgsl` file to a pipeline: the build links each with what it imports (`link`), [`shader!`] names the
//! text, [`Shader::module`] hands it to a device. With the feature `watch-shaders` it is linked anew when files change.

use std::borrow::Cow;

#[cfg(feature = "watch-shaders")]
mod link;
#[cfg(feature = "watch-shaders")]
mod watch;

#[cfg(feature = "watch-shaders")]
pub use watch::ShaderWatch;

/// A shader, linked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shader {
    /// Its file, as a path of modules: `raycast::raycast`.
    pub(crate) path: &'static str,
    /// Its text with all that it imports, as the build found them.
    pub(crate) linked: &'static str,
}

/// The [`Shader`] of a path of modules, which `link.rs` must list.
macro_rules! shader {
    ($first:ident $(:: $rest:ident)*) => {
        $crate::shaders::Shader {
            path: concat!(stringify!($first) $(, "::", stringify!($rest))*),
            linked: include_str!(
                concat!(env!("OUT_DIR"), "/", stringify!($first) $(, "_", stringify!($rest))*, ".wgsl")
            ),
        }
    };
}
pub(crate) use shader;

impl Shader {
    /// It on a device; what a driver has against it bears the name of its path.
    pub(crate) fn module(self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.path),
            source: wgpu::ShaderSource::Wgsl(self.source()),
        })
    }

    /// Its text: the build's, unless a file has changed since.
    fn source(self) -> Cow<'static, str> {
        #[cfg(feature = "watch-shaders")]
        if let Some(newer) = watch::newer(self.path) {
            return Cow::Owned(newer);
        }
        Cow::Borrowed(self.linked)
    }
}
