//! Values of options: from text to numbers and names, and back to text that people read.
//!
//! What a number may be in general is decided here (finite), so that no option needs to think of NaN;
//! what it may be for one option is decided where it is used.

use std::num::NonZeroU32;
use std::str::FromStr;

use cutaway_core::clip::{BufferDepth, ClipEvents, Impregnation, SegmentCount};
use cutaway_core::defaults::View;
use cutaway_core::lighting::DiffuseCurve;
pub(crate) use cutaway_core::numbers::short as shown;
use cutaway_core::scene::{Engine, Gradient, ImageInterpolation, Layout, Mode, Sampling, SpaceSkipping};
use cutaway_core::volume::NanMeaning;
use cutaway_io::mesh::MeshSpace;

use crate::report::wrong_use;

/// More threads than any machine has cores; far more take minutes to start.
const MOST_THREADS: usize = 1024;

/// A finite number.
pub(crate) fn number(text: &str) -> Result<f64, String> {
    let v: f64 = text.trim().parse().map_err(|_| format!("`{text}` is not a number"))?;
    if !v.is_finite() {
        return Err(format!("`{text}` is not a finite number"));
    }
    Ok(v)
}

/// A whole number of 0 or more.
pub(crate) fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.trim().parse().map_err(|_| format!("`{text}` is not a whole number of 0 or more"))
}

/// A number of threads; 0 is one a core.
pub(crate) fn threads(text: &str) -> Result<usize, String> {
    match whole::<usize>(text) {
        Ok(n) if n <= MOST_THREADS => Ok(n),
        _ => Err(format!("`{text}` is not a whole number of 0 to {MOST_THREADS}")),
    }
}

/// A factor above 0.
pub(crate) fn gain(text: &str) -> Result<f32, String> {
    let factor = number(text)? as f32;
    if factor > 0.0 && factor.is_finite() {
        Ok(factor)
    } else {
        Err(format!("`{text}` is not a factor above 0"))
    }
}

/// Numbers separated by commas.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct List(pub(crate) Vec<f64>);

impl FromStr for List {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split(',').map(number).collect::<Result<_, _>>().map(List)
    }
}

impl List {
    /// Exactly `N` numbers, or an error that names the option.
    pub(crate) fn exactly<const N: usize>(&self, option: &str) -> anyhow::Result<[f64; N]> {
        let found = self.0.len();
        self.0
            .clone()
            .try_into()
            .map_err(|_| wrong_use(format!("{option} takes {N} numbers separated by commas, found {found}")))
    }

    /// Exactly `N` whole numbers of 0 or more.
    pub(crate) fn exactly_whole<const N: usize>(&self, option: &str) -> anyhow::Result<[u32; N]> {
        let numbers = self.exactly::<N>(option)?;
        match numbers.iter().find(|v| v.fract() != 0.0 || **v < 0.0 || **v > f64::from(u32::MAX)) {
            Some(v) => Err(wrong_use(format!(
                "{option} takes whole numbers of 0 to {}, found {}",
                u32::MAX,
                shown(*v)
            ))),
            None => Ok(numbers.map(|v| v as u32)),
        }
    }
}

/// The name most like `text`, if any is.
pub(crate) fn closest<'a>(text: &str, names: &[&'a str]) -> Option<&'a str> {
    let text = text.to_ascii_lowercase();
    let likeness = |name: &str| strsim::jaro_winkler(&text, &name.to_ascii_lowercase());
    let best = names.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    (likeness(best) > 0.75).then_some(*best)
}

/// `; did you mean ...?`, or nothing where no name is like `text`.
pub(crate) fn tip(text: &str, names: &[&str]) -> String {
    closest(text, names).map_or(String::new(), |name| format!("; did you mean `{name}`?"))
}

/// Parses the names that `all` gives its values.
fn named<T: Copy>(text: &str, what: &str, all: &[(&str, T)]) -> Result<T, String> {
    all.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
        format!("no such {what}; choose from {}{}", names.join(", "), tip(text, &names))
    })
}

pub(crate) fn engine(text: &str) -> Result<Engine, String> {
    let all = [Engine::Auto, Engine::Cpu, Engine::Raycast, Engine::Slices, Engine::Cells, Engine::Reference]
        .map(|e| (e.name(), e));
    named(text, "engine", &all)
}

pub(crate) fn view(text: &str) -> Result<View, String> {
    named(text, "view", &View::ALL.map(|v| (v.name(), v)))
}

pub(crate) fn mode(text: &str) -> Result<Mode, String> {
    named(text, "mode", &Mode::ALL.map(|m| (m.name(), m)))
}

pub(crate) fn diffuse_curve(text: &str) -> Result<DiffuseCurve, String> {
    let all = [
        ("clamped", DiffuseCurve::Clamped),
        ("two-sided", DiffuseCurve::TwoSided),
        ("wrapped", DiffuseCurve::Wrapped),
    ];
    named(text, "curve", &all)
}

pub(crate) fn impregnation(text: &str) -> Result<Impregnation, String> {
    let all = [("none", Impregnation::None), ("step", Impregnation::Step), ("linear", Impregnation::Linear)];
    named(text, "impregnation", &all)
}

/// `auto` or a number of segments.
pub(crate) fn segment_count(text: &str) -> Result<SegmentCount, String> {
    if text == "auto" {
        return Ok(SegmentCount::Auto);
    }
    let most = text.trim().parse::<NonZeroU32>().map(SegmentCount::AtMost);
    most.map_err(|_| format!("`{text}` is neither `auto` nor a whole number of 1 to {}", u32::MAX))
}

pub(crate) fn space_skipping(text: &str) -> Result<SpaceSkipping, String> {
    named(text, "way of skipping", &SpaceSkipping::ALL.map(|how| (how.name(), how)))
}

/// All ways, whichever engine has them: what stands in for another engine's is said when the engine is known.
pub(crate) fn clip_events(text: &str) -> Result<ClipEvents, String> {
    named(text, "way of finding events", &ClipEvents::ALL.map(|how| (how.name(), how)))
}

pub(crate) fn mesh_space(text: &str) -> Result<MeshSpace, String> {
    named(text, "space of meshes", &MeshSpace::ALL.map(|space| (space.name(), space)))
}

pub(crate) fn buffer_depth(text: &str) -> Result<BufferDepth, String> {
    let depth = text.trim().parse().ok().and_then(BufferDepth::from_bits);
    depth.ok_or_else(|| format!("`{text}` is no depth of a layer; choose from 16, 32"))
}

pub(crate) fn sampling(text: &str) -> Result<Sampling, String> {
    named(text, "way of sampling", &[("view", Sampling::View), ("object", Sampling::Object)])
}

pub(crate) fn gradient(text: &str) -> Result<Gradient, String> {
    let all =
        [("central", Gradient::Central), ("sobel", Gradient::Sobel), ("precomputed", Gradient::Precomputed)];
    named(text, "gradient", &all)
}

pub(crate) fn nan(text: &str) -> Result<NanMeaning, String> {
    named(text, "meaning of NaN", &NanMeaning::ALL.map(|meaning| (meaning.name(), meaning)))
}

pub(crate) fn layout(text: &str) -> Result<Layout, String> {
    named(text, "layout", &[("linear", Layout::Linear), ("bricks", Layout::Bricks)])
}

/// Off, adaptive, or a factor; which factors there are is the scene's to say.
pub(crate) fn image_interpolation(text: &str) -> Result<ImageInterpolation, String> {
    match text {
        "off" => Ok(ImageInterpolation::Off),
        "adaptive" => Ok(ImageInterpolation::Adaptive),
        _ => text.parse().map(ImageInterpolation::Factor).map_err(|_| {
            let tip = tip(text, &["off", "adaptive"]);
            format!("choose from off, adaptive or a whole number of 2 to 16{tip}")
        }),
    }
}

/// The ends of a range, with as many digits as tell one from the other.
pub(crate) fn shown_range([lo, hi]: [f64; 2]) -> String {
    let rounded = |v: f64| (shown(v).parse::<f64>().unwrap_or(v) - v).abs();
    let close = rounded(lo).max(rounded(hi)) > 1e-4 * (hi - lo);
    let text = |v: f64| match shown(v) {
        _ if close => format!("{v:?}").trim_end_matches(".0").to_owned(),
        text => text,
    };
    format!("{} to {}", text(lo), text(hi))
}

/// A vector as people write it.
pub(crate) fn shown_vector(v: [f64; 3]) -> String {
    v.map(shown).join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_numbers_only() {
        assert_eq!("1, -2.5,3e2".parse(), Ok(List(vec![1.0, -2.5, 300.0])));
        for bad in ["", "1,,2", "1;2", "nan", "inf,1", "1e309"] {
            assert!(bad.parse::<List>().is_err(), "{bad}");
        }
    }

    #[test]
    fn ranges_have_the_digits_that_differ() {
        assert_eq!(shown_range([101_325.0, 101_325.01]), "101325 to 101325.01");
        assert_eq!(shown_range([1e9, 1e9 + 1e-6]), "1000000000 to 1000000000.000001");
        assert_eq!(shown_range([1.0, 1.000_000_1]), "1 to 1.0000001");
        assert_eq!(shown_range([0.0, f64::from(0.3f32)]), "0 to 0.3");
        assert_eq!(shown_range([0.0, 0.0]), "0 to 0");
        assert_eq!(shown_range([0.0, 1e-60]), "0 to 1e-60");
    }

    #[test]
    fn near_misses_are_guessed() {
        assert!(mode("composit").unwrap_err().contains("did you mean `composite`"));
        assert!(engine("cell").unwrap_err().contains("did you mean `cells`"));
        assert_eq!(tip("xyz", &["composite"]), "");
    }

    #[test]
    fn whole_numbers_have_their_bounds() {
        assert_eq!((threads("0"), threads("1024")), (Ok(0), Ok(1024)));
        for bad in ["-1", "1025", "x", "99999999999999999999999"] {
            assert!(threads(bad).is_err(), "{bad}");
        }
        assert!(List(vec![1.5]).exactly_whole::<1>("--n").is_err());
        assert!(List(vec![1e12]).exactly_whole::<1>("--n").is_err());
        assert_eq!(List(vec![4e9]).exactly_whole::<1>("--n").unwrap(), [4_000_000_000]);
    }

    #[test]
    fn numbers_are_short() {
        let values = [1.0, 0.5, -0.0, 0.957031, 1e-9, -3e38, 1_000_000.0];
        assert_eq!(values.map(shown), ["1", "0.5", "0", "0.957031", "1e-9", "-3e38", "1000000"]);
    }
}
