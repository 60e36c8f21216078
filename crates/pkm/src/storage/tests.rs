//! Every crash and every failing step of a save, on a simulated disk that logs what it was asked (promise P7).

use super::{Storage, save};
use pkm_gcode::{ParameterFile, Parameters};
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Sectors are written whole or not at all.
const SECTOR: usize = 512;

type FileNumber = usize;

/// What the disk was asked, in order.
#[derive(Debug, Clone)]
enum Step {
    Create(FileNumber, PathBuf),
    Append(FileNumber, Vec<u8>),
    Sync(FileNumber),
    Rename(PathBuf, PathBuf),
    SyncFolder,
    Remove(PathBuf),
}

/// A way to fail.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    Error(i32),
    ShortWrite,
}

/// A disk with a cache: what was asked is safe only once it was synced.
#[derive(Debug, Clone, Default)]
struct SimulatedDisk {
    /// What was on the disk before.
    before: BTreeMap<PathBuf, Vec<u8>>,
    log: Vec<Step>,
    /// The names as a running system sees them.
    names: BTreeMap<PathBuf, FileNumber>,
    files: FileNumber,
    /// The step to fail, counted from 0.
    fault: Option<(usize, Fault)>,
    steps: usize,
    /// A disk that forgets to sync, to see that the test sees it.
    forgets_sync: bool,
}

impl SimulatedDisk {
    fn fails(&mut self) -> io::Result<Option<Fault>> {
        let step = self.steps;
        self.steps += 1;
        match self.fault {
            Some((at, Fault::Error(number))) if at == step => Err(io::Error::from_raw_os_error(number)),
            Some((at, fault)) if at == step => Ok(Some(fault)),
            _ => Ok(None),
        }
    }

    /// The files after a crash behind the first `done` steps, where of the steps that no sync has made safe only those in
    /// `kept` (a bit each) have reached the disk, and of the last kept write only the first `sectors` sectors.
    fn after_crash(&self, done: usize, kept: u64, sectors: Option<usize>) -> BTreeMap<PathBuf, Vec<u8>> {
        let loose = self.loose(done);
        let reached = |i: usize| loose.iter().position(|l| *l == i).is_none_or(|bit| kept >> bit & 1 == 1);
        let last_write = (0..done).rev().find(|i| reached(*i) && matches!(self.log[*i], Step::Append(..)));
        let mut contents: Vec<Vec<u8>> = vec![Vec::new(); self.files];
        let mut names: BTreeMap<PathBuf, Result<FileNumber, Vec<u8>>> =
            self.before.iter().map(|(path, bytes)| (path.clone(), Err(bytes.clone()))).collect();
        // A name that has not reached the disk still tells what a rename means.
        let mut meant: BTreeMap<PathBuf, FileNumber> = BTreeMap::new();
        for (i, step) in self.log[..done].iter().enumerate() {
            match step {
                Step::Create(file, path) => {
                    meant.insert(path.clone(), *file);
                    if reached(i) {
                        names.insert(path.clone(), Ok(*file));
                    }
                }
                Step::Append(file, bytes) => {
                    let mut bytes = bytes.clone();
                    match sectors {
                        _ if !reached(i) => bytes.fill(0), // the length is known, the content is not
                        Some(sectors) if last_write == Some(i) && loose.contains(&i) => {
                            bytes.truncate(sectors * SECTOR);
                        }
                        _ => {}
                    }
                    contents[*file].extend(bytes);
                }
                Step::Rename(from, to) => {
                    let file = meant.remove(from).expect("known");
                    meant.insert(to.clone(), file);
                    if reached(i) {
                        names.remove(from);
                        names.insert(to.clone(), Ok(file));
                    }
                }
                Step::Remove(path) => {
                    meant.remove(path);
                    if reached(i) {
                        names.remove(path);
                    }
                }
                Step::Sync(_) | Step::SyncFolder => {}
            }
        }
        let content = |file: Result<FileNumber, Vec<u8>>| {
            file.map_or_else(|bytes| bytes, |file| contents[file].clone())
        };
        names.into_iter().map(|(path, file)| (path, content(file))).collect()
    }

    /// The steps among the first `done` that no sync has made safe.
    fn loose(&self, done: usize) -> Vec<usize> {
        let safe = |i: usize| {
            self.log[i + 1..done].iter().any(|later| match (&self.log[i], later) {
                (Step::Append(file, _), Step::Sync(synced)) => file == synced,
                (Step::Append(..) | Step::Sync(_), _) => false,
                (_, Step::SyncFolder) => true,
                _ => false,
            })
        };
        let changes = |i: &usize| !matches!(self.log[*i], Step::Sync(_) | Step::SyncFolder);
        (0..done).filter(changes).filter(|i| !safe(*i)).collect()
    }
}

impl Storage for SimulatedDisk {
    fn create(&mut self, path: &Path, _: &Path) -> io::Result<()> {
        self.fails()?;
        self.names.insert(path.into(), self.files);
        self.log.push(Step::Create(self.files, path.into()));
        self.files += 1;
        Ok(())
    }

    fn append(&mut self, path: &Path, bytes: &[u8]) -> io::Result<usize> {
        let taken = match self.fails()? {
            Some(_) => bytes.len().min(100),
            None => bytes.len(),
        };
        self.log.push(Step::Append(self.names[path], bytes[..taken].to_vec()));
        Ok(taken)
    }

    fn sync(&mut self, path: &Path) -> io::Result<()> {
        self.fails()?;
        if !self.forgets_sync {
            self.log.push(Step::Sync(self.names[path]));
        }
        Ok(())
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        self.fails()?;
        let file = self.names.remove(from).expect("it is there");
        self.names.insert(to.into(), file);
        self.log.push(Step::Rename(from.into(), to.into()));
        Ok(())
    }

    fn sync_folder(&mut self, _: &Path) -> io::Result<()> {
        self.fails()?;
        self.log.push(Step::SyncFolder);
        Ok(())
    }

    fn remove(&mut self, path: &Path) -> io::Result<()> {
        self.fails()?;
        if self.names.remove(path).is_none() {
            return Err(ErrorKind::NotFound.into());
        }
        self.log.push(Step::Remove(path.into()));
        Ok(())
    }
}

fn text(x: f64) -> Vec<u8> {
    let mut parameters = Parameters::default();
    for index in 5221..=5229 {
        parameters.set(index, x);
    }
    ParameterFile::default().text(&parameters)
}

/// What a saved file turns out to be when it is read.
#[derive(Debug, PartialEq)]
enum Loaded {
    Missing,
    Old,
    New,
    Refused,
}

fn load(image: &BTreeMap<PathBuf, Vec<u8>>, name: &str) -> Loaded {
    let Some(bytes) = image.get(Path::new(name)) else { return Loaded::Missing };
    let mut parameters = Parameters::default();
    match ParameterFile::read(bytes, &mut parameters) {
        Err(_) => Loaded::Refused,
        Ok(_) if *bytes == text(1.0) => Loaded::Old,
        Ok(_) if *bytes == text(2.0) => Loaded::New,
        Ok(_) => panic!("half read: {bytes:?}"),
    }
}

/// A disk after a save of the new content, and its `.bak`, over the old one or over nothing.
fn saved(over_old: bool, fault: Option<(usize, Fault)>, forgets_sync: bool) -> (SimulatedDisk, bool) {
    let (old, new) = (text(1.0), text(2.0));
    let mut disk = SimulatedDisk { fault, forgets_sync, ..SimulatedDisk::default() };
    let mut files = Vec::new();
    if over_old {
        disk.before.insert("p.var".into(), old.clone());
        files.push((PathBuf::from("p.var.bak"), &old[..]));
    }
    files.push((PathBuf::from("p.var"), &new[..]));
    let result = save(&mut disk, &files);
    (disk, result.is_ok())
}

/// Every image that a crash at any moment can leave.
fn images(disk: &SimulatedDisk) -> Vec<BTreeMap<PathBuf, Vec<u8>>> {
    let mut images = Vec::new();
    for done in 0..=disk.log.len() {
        let loose = disk.loose(done).len();
        assert!(loose < 16, "{loose} steps that no sync has made safe");
        for kept in 0..1_u64 << loose {
            images.push(disk.after_crash(done, kept, None));
            let longest = disk.log[..done].iter().map(|step| match step {
                Step::Append(_, bytes) => bytes.len().div_ceil(SECTOR),
                _ => 0,
            });
            for sectors in 0..longest.max().unwrap_or(0) {
                images.push(disk.after_crash(done, kept, Some(sectors)));
            }
        }
    }
    images
}

#[test]
fn a_crash_at_any_moment_leaves_the_old_or_the_new_content() {
    for over_old in [true, false] {
        let (disk, ok) = saved(over_old, None, false);
        assert!(ok);
        let images = images(&disk);
        assert!(images.len() > if over_old { 200 } else { 50 }, "{} images", images.len());
        let mut news = 0;
        for image in &images {
            let loaded = load(image, "p.var");
            let before = if over_old { Loaded::Old } else { Loaded::Missing };
            assert!(loaded == before || loaded == Loaded::New, "{loaded:?} in {image:?}");
            news += usize::from(loaded == Loaded::New);
            // The .bak is what the file was before, or not there yet.
            assert!(matches!(load(image, "p.var.bak"), Loaded::Missing | Loaded::Old));
        }
        assert!(news > 0);
        let last = disk.after_crash(disk.log.len(), 0, None);
        assert_eq!(load(&last, "p.var"), Loaded::New, "when save returns, the new content is safe");
        eprintln!("{} images after a crash", images.len());
    }
}

/// The test can fail: without sync before the rename, a crash leaves a torn file. It is refused, never half read.
#[test]
fn a_forgotten_sync_is_seen() {
    let (disk, ok) = saved(true, None, true);
    assert!(ok);
    assert!(images(&disk).iter().any(|image| load(image, "p.var") == Loaded::Refused));
}

#[test]
fn every_failing_step_leaves_the_old_or_the_new_content() {
    // Linux's numbers: EINTR, EIO, EACCES, ENOSPC, EROFS.
    let errors = [4, 5, 13, 28, 30].map(Fault::Error);
    let mut refused = 0;
    let (whole, _) = saved(true, None, false);
    for at in 0..whole.steps {
        for fault in errors.into_iter().chain([Fault::ShortWrite]) {
            let (disk, ok) = saved(true, Some((at, fault)), false);
            let image = disk.after_crash(disk.log.len(), u64::MAX, None);
            let loaded = load(&image, "p.var");
            assert!(
                loaded == if ok { Loaded::New } else { Loaded::Old }
                    || loaded == Loaded::New && at + 1 == whole.steps,
                "step {at}, {fault:?}: {loaded:?}"
            );
            assert!(
                image.keys().all(|path| !path.to_string_lossy().ends_with(".new")),
                "left behind: {image:?}"
            );
            for image in images(&disk) {
                assert!(matches!(load(&image, "p.var"), Loaded::Old | Loaded::New), "step {at}, {fault:?}");
            }
            refused += usize::from(!ok);
        }
    }
    assert!(refused >= whole.steps * 4, "{refused} of {} steps", whole.steps);
}
