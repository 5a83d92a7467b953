use std::io::Write;

use super::*;

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn write(path: &Path, content: &[u8]) -> Result<(), AtomicWriteError<io::Error>> {
    write_atomically(path, |w| w.write_all(content))
}

#[test]
fn a_file_is_written_and_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bin");
    write(&path, b"first, and longer").unwrap();
    write(&path, b"second").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"second");
    assert_eq!(entries(folder.path()), ["a.bin"]);
}

#[test]
fn a_failing_writer_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bin");
    let fail = |w: &mut BufWriter<File>| -> Result<(), &str> {
        w.write_all(&[7; 1 << 17]).unwrap();
        Err("out of ideas")
    };
    let error = write_atomically(&path, fail).unwrap_err();
    assert_eq!(error.to_string(), format!("cannot write '{}': out of ideas", path.display()));
    assert!(entries(folder.path()).is_empty());

    write(&path, b"old").unwrap();
    write_atomically(&path, fail).unwrap_err();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(entries(folder.path()), ["a.bin"]);
}

#[test]
fn a_panicking_writer_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bin");
    let panicked = std::panic::catch_unwind(|| {
        write_atomically(&path, |_| -> Result<(), io::Error> { panic!("a defect in a writer") })
    });
    assert!(panicked.is_err());
    assert!(entries(folder.path()).is_empty());
}

#[test]
fn nothing_is_seen_before_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bin");
    let seen = write_atomically(&path, |w| {
        w.write_all(b"half")?;
        w.flush()?;
        Ok::<_, io::Error>(path.exists())
    });
    assert!(!seen.unwrap() && path.exists());
}

#[test]
fn what_cannot_be_a_file_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    write(&file, b"x").unwrap();
    let cases = [
        (folder.path().to_owned(), "it is a folder"),
        (folder.path().join("new/"), "it is a folder"),
        (folder.path().join(".."), "it is a folder"),
        (folder.path().join("none/a.png"), "does not exist; create it first"),
        (file.join("a.png"), "is not a folder"),
        (PathBuf::new(), "the path is empty"),
    ];
    for (path, expected) in cases {
        let message = write(&path, b"x").unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
        assert!(message.contains(&path.display().to_string()), "{message}");
    }
    assert_eq!(entries(folder.path()), ["file"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{PermissionsExt, symlink};

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn permissions_are_those_of_any_new_file_or_of_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let (usual, ours) = (folder.path().join("usual"), folder.path().join("ours"));
        File::create(&usual).unwrap();
        write(&ours, b"x").unwrap();
        assert_eq!(mode(&ours), mode(&usual));

        fs::set_permissions(&ours, fs::Permissions::from_mode(0o640)).unwrap();
        write(&ours, b"y").unwrap();
        assert_eq!(mode(&ours), 0o640);

        fs::set_permissions(&ours, fs::Permissions::from_mode(0o444)).unwrap();
        assert!(write(&ours, b"z").unwrap_err().to_string().contains("read-only"));
        assert_eq!(fs::read(&ours).unwrap(), b"y");
    }

    #[test]
    fn links_stay_and_their_targets_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (inner, link) = (folder.path().join("inner"), folder.path().join("link"));
        fs::create_dir(&inner).unwrap();
        symlink("inner/real", &link).unwrap();
        // At first the link leads nowhere.
        for content in [b"1", b"2"] {
            write(&link, content).unwrap();
            assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
            assert_eq!(fs::read(inner.join("real")).unwrap(), content);
        }
        symlink("loop", folder.path().join("loop")).unwrap();
        let message = write(&folder.path().join("loop"), b"x").unwrap_err().to_string();
        assert!(message.contains("symbolic links"), "{message}");
    }

    #[test]
    fn devices_are_written_to_directly() {
        write(Path::new("/dev/null"), b"gone").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("null");
        symlink("/dev/null", &link).unwrap();
        write(&link, b"gone").unwrap();
        assert_eq!(entries(folder.path()), ["null"]);
        assert!(write(Path::new("/dev/no-such-device"), b"x").is_err());
        assert!(!Path::new("/dev/no-such-device").exists());
    }

    #[test]
    fn a_fifo_stays_a_fifo() {
        let folder = tempfile::tempdir().unwrap();
        let fifo = folder.path().join("fifo");
        let made = std::process::Command::new("mkfifo").arg(&fifo).status().unwrap();
        assert!(made.success());
        let reader = std::thread::spawn({
            let fifo = fifo.clone();
            move || fs::read(fifo).unwrap()
        });
        write(&fifo, b"through the pipe").unwrap();
        assert_eq!(reader.join().unwrap(), b"through the pipe");
        assert_eq!(entries(folder.path()), ["fifo"]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn an_open_file_under_proc_keeps_what_is_in_it() {
        use std::os::fd::AsRawFd;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("redirected");
        let mut open = OpenOptions::new().append(true).create(true).open(&path).unwrap();
        open.write_all(b"before ").unwrap();
        write(Path::new(&format!("/dev/fd/{}", open.as_raw_fd())), b"after").unwrap();
        open.write_all(b" end").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"before after end");
    }
}
