//! The stub HAL and a module loaded into it.

use pkm_kins::{Joints, MAX_JOINTS};
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_long, c_ulong, c_void};
use std::path::PathBuf;
use std::sync::Mutex;

// ---- the stub HAL -------------------------------------------------------------------------------------------------------------

/// A place in HAL memory and its type.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Float,
    S32,
    Bit,
    U32Pin,
}

/// What the module that is being loaded has made: one at a time, under `LOADING`.
#[derive(Default)]
pub(crate) struct Hal {
    pub(crate) names: BTreeMap<String, (usize, Kind)>,
    pub(crate) messages: Vec<String>,
    pub(crate) ready: bool,
    pub(crate) exited: bool,
    pub(crate) refuse_malloc: bool,
    pub(crate) refuse_name: Option<String>,
    pub(crate) time_ns: i64,
}

pub(crate) static HAL: Mutex<Option<Hal>> = Mutex::new(None);
static LOADING: Mutex<()> = Mutex::new(());

pub(crate) fn hal<T>(f: impl FnOnce(&mut Hal) -> T) -> T {
    f(HAL.lock().unwrap().get_or_insert_with(Hal::default))
}

#[unsafe(no_mangle)]
extern "C" fn hal_init(_: *const c_char) -> c_int {
    7
}
#[unsafe(no_mangle)]
extern "C" fn hal_ready(id: c_int) -> c_int {
    assert_eq!(id, 7);
    hal(|hal| hal.ready = true);
    0
}
#[unsafe(no_mangle)]
extern "C" fn hal_exit(id: c_int) -> c_int {
    assert_eq!(id, 7);
    hal(|hal| hal.exited = true);
    0
}
#[unsafe(no_mangle)]
extern "C" fn hal_malloc(size: c_long) -> *mut c_void {
    if hal(|hal| hal.refuse_malloc) {
        return std::ptr::null_mut();
    }
    let words = usize::try_from(size).unwrap().div_ceil(8);
    Box::leak(vec![0_u64; words].into_boxed_slice()).as_mut_ptr().cast()
}

unsafe fn make(name: *const c_char, place: usize, id: c_int, kind: Kind) -> c_int {
    assert_eq!(id, 7);
    let name = unsafe { CStr::from_ptr(name) }.to_str().unwrap().to_owned();
    assert!(name.len() <= 41, "HAL cuts {name}");
    hal(|hal| {
        if hal.refuse_name.as_ref() == Some(&name) {
            return -22;
        }
        assert!(hal.names.insert(name.clone(), (place, kind)).is_none(), "{name} twice");
        0
    })
}
#[unsafe(no_mangle)]
unsafe extern "C" fn hal_param_float_new(
    name: *const c_char,
    dir: c_int,
    place: *mut f64,
    id: c_int,
) -> c_int {
    assert_eq!(dir, 192);
    unsafe { make(name, place.addr(), id, Kind::Float) }
}
#[unsafe(no_mangle)]
unsafe extern "C" fn hal_param_s32_new(name: *const c_char, dir: c_int, place: *mut i32, id: c_int) -> c_int {
    assert_eq!(dir, 192);
    unsafe { make(name, place.addr(), id, Kind::S32) }
}
#[unsafe(no_mangle)]
unsafe extern "C" fn hal_param_bit_new(
    name: *const c_char,
    dir: c_int,
    place: *mut bool,
    id: c_int,
) -> c_int {
    assert_eq!(dir, 192);
    unsafe { make(name, place.addr(), id, Kind::Bit) }
}
#[unsafe(no_mangle)]
unsafe extern "C" fn hal_pin_u32_new(
    name: *const c_char,
    dir: c_int,
    place: *mut *mut u32,
    id: c_int,
) -> c_int {
    assert_eq!(dir, 32);
    let pin: *mut u32 = Box::leak(Box::new(0));
    let made = unsafe { make(name, pin.addr(), id, Kind::U32Pin) };
    if made == 0 {
        unsafe { place.write(pin) };
    }
    made
}
#[unsafe(no_mangle)]
extern "C" fn rtapi_get_time() -> i64 {
    hal(|hal| hal.time_ns)
}
/// A Rust function cannot take C's variable arguments; the format and the module's name (the first argument) are enough.
#[unsafe(no_mangle)]
unsafe extern "C" fn rtapi_print_msg(level: c_int, format: *const c_char, name: *const c_char) {
    assert_eq!(level, 1);
    let text = |p| unsafe { CStr::from_ptr(p) }.to_str().unwrap().to_owned();
    let message = text(format).replacen("%s", &text(name), 1);
    hal(|hal| hal.messages.push(message));
}

unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(module: *mut c_void, name: *const c_char) -> *mut c_void;
    fn dlerror() -> *const c_char;
}
const RTLD_NOW: c_int = 2;

// ---- a loaded module ----------------------------------------------------------------------------------------------------------

type Forward = unsafe extern "C" fn(*const f64, *mut [f64; 9], *const c_ulong, *mut c_ulong) -> c_int;
type Inverse = unsafe extern "C" fn(*const [f64; 9], *mut f64, *const c_ulong, *mut c_ulong) -> c_int;

pub(crate) struct Module {
    pub(crate) main: unsafe extern "C" fn() -> c_int,
    pub(crate) exit: unsafe extern "C" fn(),
    pub(crate) forward: Forward,
    pub(crate) inverse: Inverse,
    pub(crate) kind: unsafe extern "C" fn() -> c_int,
    pub(crate) switchable: unsafe extern "C" fn() -> c_int,
    pub(crate) switch: unsafe extern "C" fn(c_int) -> c_int,
    machine: *mut *const c_char,
    /// Frees the stub for the next test.
    _loading: std::sync::MutexGuard<'static, ()>,
}

/// The shared object of this name that cargo built beside this test, or in the folder of `PKM_MODULES`: the modules as they
/// are installed.
fn shared_object(name: &str) -> PathBuf {
    if let Some(folder) = std::env::var_os("PKM_MODULES") {
        return PathBuf::from(folder).join(format!("lib{name}.so"));
    }
    let exe = std::env::current_exe().unwrap();
    let profile = exe.parent().unwrap().parent().unwrap();
    profile.join(format!("examples/lib{name}.so"))
}

impl Module {
    pub(crate) fn open(name: &str) -> Self {
        let loading = LOADING.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *HAL.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(Hal::default());
        let path = CString::new(shared_object(name).to_str().unwrap()).unwrap();
        unsafe {
            let module = dlopen(path.as_ptr(), RTLD_NOW);
            assert!(!module.is_null(), "{}", CStr::from_ptr(dlerror()).to_string_lossy());
            let symbol = |name: &CStr| {
                let symbol = dlsym(module, name.as_ptr());
                assert!(!symbol.is_null(), "{name:?}");
                symbol
            };
            assert_eq!(
                CStr::from_ptr(symbol(c"rtapi_info_type_machine").cast::<*const c_char>().read()),
                c"s"
            );
            Self {
                main: std::mem::transmute::<*mut c_void, unsafe extern "C" fn() -> c_int>(symbol(
                    c"rtapi_app_main",
                )),
                exit: std::mem::transmute::<*mut c_void, unsafe extern "C" fn()>(symbol(c"rtapi_app_exit")),
                forward: std::mem::transmute::<*mut c_void, Forward>(symbol(c"kinematicsForward")),
                inverse: std::mem::transmute::<*mut c_void, Inverse>(symbol(c"kinematicsInverse")),
                kind: std::mem::transmute::<*mut c_void, unsafe extern "C" fn() -> c_int>(symbol(
                    c"kinematicsType",
                )),
                switchable: std::mem::transmute::<*mut c_void, unsafe extern "C" fn() -> c_int>(symbol(
                    c"kinematicsSwitchable",
                )),
                switch: std::mem::transmute::<*mut c_void, unsafe extern "C" fn(c_int) -> c_int>(symbol(
                    c"kinematicsSwitch",
                )),
                machine: symbol(c"rtapi_info_address_machine").cast::<*mut *const c_char>().read(),
                _loading: loading,
            }
        }
    }

    /// `loadrt NAME machine=MACHINE`
    pub(crate) fn load(&self, machine: &str) -> c_int {
        let machine = CString::new(machine).unwrap();
        unsafe {
            self.machine.write(machine.into_raw());
            (self.main)()
        }
    }

    pub(crate) fn inverse(&self, pose: &[f64; 9]) -> Result<Joints, c_int> {
        let mut joints = [f64::NAN; 16];
        let (flags, mut out) = (0, 0);
        match unsafe { (self.inverse)(pose, joints.as_mut_ptr(), &raw const flags, &raw mut out) } {
            0 => {
                let mut all = [0.0; MAX_JOINTS];
                for (place, joint) in all.iter_mut().zip(joints) {
                    *place = if joint.is_nan() { 0.0 } else { joint };
                }
                Ok(all)
            }
            error => Err(error),
        }
    }

    pub(crate) fn forward(&self, joints: &Joints, seed: &[f64; 9]) -> Result<[f64; 9], c_int> {
        let mut all = [0.0; 16];
        all[..MAX_JOINTS].copy_from_slice(joints);
        let mut pose = *seed;
        let (flags, mut out) = (0, 0);
        match unsafe { (self.forward)(all.as_ptr(), &raw mut pose, &raw const flags, &raw mut out) } {
            0 => Ok(pose),
            error => Err(error),
        }
    }
}

pub(crate) fn setp(name: &str, value: f64) {
    let (place, kind) =
        hal(|hal| *hal.names.get(name).unwrap_or_else(|| panic!("no {name}: {:?}", hal.names.keys())));
    unsafe {
        match kind {
            Kind::Float => (place as *mut f64).write_volatile(value),
            Kind::S32 => (place as *mut i32).write_volatile(value as i32),
            Kind::Bit => (place as *mut bool).write_volatile(value != 0.0),
            Kind::U32Pin => panic!("{name} is an output"),
        }
    }
}

pub(crate) fn pin(name: &str) -> u32 {
    let (place, kind) = hal(|hal| hal.names[name]);
    assert_eq!(kind, Kind::U32Pin);
    unsafe { (place as *const u32).read_volatile() }
}

pub(crate) fn messages() -> Vec<String> {
    hal(|hal| std::mem::take(&mut hal.messages))
}

/// A second passes.
pub(crate) fn wait() {
    hal(|hal| hal.time_ns += 1_000_000_000);
}
