//! What panels ask of the window: everything that needs files, threads or dialogs.

use std::path::PathBuf;

/// What a file is picked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Purpose {
    /// A volume, or a scene file.
    Open,
    /// A mesh or spline patches that cut.
    AddSolid,
    /// A transfer function to be read.
    OpenFunction,
    /// A transfer function to be written.
    SaveFunction,
    /// The scene, written under another name.
    SaveScene,
    /// A picture of the view.
    SaveImage,
    /// A film of the view turning.
    SaveFilm,
}

/// What a panel asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// A file is picked in a dialog, and used.
    PickFile(Purpose),
    /// A file is used for what it was picked for.
    UseFile(Purpose, PathBuf),
    /// An error is shown until it is dismissed: one line.
    Report(String),
    /// The scene is written to the file it came from.
    Save,
    /// The command line that renders this picture goes to the clipboard.
    CopyCommandLine,
}
