//! From the settings that libraries name to the options of the command line.

/// Settings that an option sets, by their names in scene files. The option has hyphens for the underscores.
const SETTINGS: [&str; 20] = [
    "engine",
    "mode",
    "step",
    "early_termination",
    "space_skipping",
    "image_interpolation",
    "sampling",
    "adaptive_threshold",
    "pre_integration",
    "gradient",
    "layout",
    "jitter",
    "brick_size",
    "clip_events",
    "buffer_depth",
    "segments",
    "backmost",
    "resolution",
    "blur",
    "iso",
];

/// Returns a message of a library with the options of the command line for the settings that it names: `set engine to cpu`
/// becomes `use --engine cpu`, and a setting at the start of the message becomes its option.
pub(crate) fn as_options(message: &str) -> String {
    let mut text = message.to_owned();
    for setting in SETTINGS {
        let option = format!("--{}", setting.replace('_', "-"));
        text = text.replace(&format!("set {setting} to "), &format!("use {option} "));
        if setting.contains('_') {
            text = text.replace(setting, &option);
        } else if let Some(rest) = text.strip_prefix(&format!("{setting} ")) {
            text = format!("{option} {rest}");
        }
    }
    // Switches have no value.
    text.replace(" true has no effect", " has no effect")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn settings_become_options() {
        let said = as_options("jitter true has no effect with the cpu engine");
        assert_eq!(said, "--jitter has no effect with the cpu engine");
        let said = as_options("brick_size 8 has no effect with the cells engine");
        assert_eq!(said, "--brick-size 8 has no effect with the cells engine");
        let said = as_options("the slices engine does not have iso mode; set engine to cpu or raycast");
        assert_eq!(said, "the slices engine does not have iso mode; use --engine cpu or raycast");
    }

    #[test]
    fn every_setting_is_an_option() {
        let command = crate::args::Cli::command();
        let render = command.find_subcommand("render").unwrap();
        for setting in SETTINGS {
            let option = setting.replace('_', "-");
            assert!(render.get_arguments().any(|a| a.get_long() == Some(&option)), "{option}");
        }
    }
}
