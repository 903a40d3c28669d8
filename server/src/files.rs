//! Safely reads files that other users may have placed where the server looks. A pipe would block the reader forever,
//! and a device or a huge file would exhaust memory, so only regular files are read, up to a size limit.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

/// Opens a regular file, or a link to one, for reading. Anything else results in an error rather than blocking.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let file = without_waiting(OpenOptions::new().read(true)).open(path)?;
    if !file.metadata()?.is_file() {
        let text =
            "found no regular file; allowed: a file, neither a directory nor a pipe nor a device";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    Ok(file)
}

/// Reads a regular file of up to `bytes_max` bytes.
pub fn read_regular(path: &Path, bytes_max: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(bytes_max as u64 + 1).read_to_end(&mut bytes)?;
    if bytes.len() > bytes_max {
        let text = format!("found more than {bytes_max} bytes; allowed: at most that");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, text));
    }
    Ok(bytes)
}

/// Lets opening a pipe return or fail immediately, instead of blocking until the other end is opened.
pub fn without_waiting(options: &mut OpenOptions) -> &mut OpenOptions {
    #[cfg(unix)]
    {
        let flags = rustix::fs::OFlags::NONBLOCK.bits() as i32;
        std::os::unix::fs::OpenOptionsExt::custom_flags(options, flags);
    }
    options
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn place(name: &str) -> PathBuf {
        let number = crate::host::random();
        std::env::temp_dir().join(format!("jostle-files-{number:016x}-{name}"))
    }

    #[test]
    fn files_are_read_up_to_their_length() {
        let file = place("short");
        std::fs::write(&file, "12345").expect("a place");
        assert_eq!(read_regular(&file, 5).expect("a file"), b"12345");
        let error = read_regular(&file, 4).expect_err("a longer file");
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(error.to_string().contains("more than 4 bytes"), "{error}");
        std::fs::remove_file(&file).expect("the file");
        assert_eq!(read_regular(&file, 4).expect_err("no file").kind(), io::ErrorKind::NotFound);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn neither_pipes_nor_devices_nor_directories_are_read() {
        let (pipe, link) = (place("pipe"), place("link"));
        let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
        rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, mode).expect("a pipe");
        std::os::unix::fs::symlink("/dev/zero", &link).expect("a link");
        for path in [&pipe, &link, &std::env::temp_dir()] {
            let error = read_regular(path, 1 << 20).expect_err("no regular file");
            assert!(error.to_string().contains("no regular file"), "{}: {error}", path.display());
        }
        // Opening a pipe for writing must not wait for a reader either.
        let opened = without_waiting(OpenOptions::new().write(true)).open(&pipe);
        assert!(opened.is_err());
        for path in [pipe, link] {
            std::fs::remove_file(path).expect("the file");
        }
    }
}
