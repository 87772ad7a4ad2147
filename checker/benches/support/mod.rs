//! What the benchmarks share: a folder of their own, and C programs.

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder for this run, removed in the end.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> Result<Scratch, Box<dyn Error>> {
        let folder = std::env::temp_dir().join(format!("ntagen-bench-{}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        Ok(Scratch(folder))
    }

    /// Compiles a C program of this repository by `cc -O2`, and what more is given: options, which
    /// win, and other sources.
    pub(crate) fn compile(
        &self,
        source: &str,
        more: &[OsString],
    ) -> Result<PathBuf, Box<dyn Error>> {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(source);
        let program = self
            .0
            .join(source.file_stem().ok_or("the source is a file")?);
        let compiled = Command::new("cc")
            .args(["-O2", "-o"])
            .args([&program, &source])
            .args(more)
            .arg("-lm")
            .status()?;
        if !compiled.success() {
            return Err("cc failed".into());
        }
        Ok(program)
    }

    #[allow(dead_code, reason = "not every benchmark writes files itself")]
    /// Where files of this run go.
    pub(crate) fn folder(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that is left over in the temporary one does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
