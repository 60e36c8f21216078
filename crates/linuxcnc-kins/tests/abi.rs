//! The modules as LinuxCNC loads them, without LinuxCNC: this binary stands in for the HAL, opens the shared objects that cargo
//! built beside it with `dlopen`, as `rtapi_app` does, and calls what `motmod` calls.
#![cfg(target_os = "linux")]
#![allow(unsafe_code)] // the C side of the interface

use pkm_kins::*;
use pkm_linuxcnc_kins::mechanism;
use pkm_linuxcnc_kins::switchable::OxGlideKins;
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_long, c_ulong, c_void};
use std::path::PathBuf;
use std::sync::Mutex;

// ---- the stub HAL -------------------------------------------------------------------------------------------------------------

/// A place in HAL memory and its type.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Float,
    S32,
    Bit,
    U32Pin,
}

/// What the module that is being loaded has made: one at a time, under `LOADING`.
#[derive(Default)]
struct Hal {
    names: BTreeMap<String, (usize, Kind)>,
    messages: Vec<String>,
    ready: bool,
    exited: bool,
    refuse_malloc: bool,
    refuse_name: Option<String>,
    time_ns: i64,
}

static HAL: Mutex<Option<Hal>> = Mutex::new(None);
static LOADING: Mutex<()> = Mutex::new(());

fn hal<T>(f: impl FnOnce(&mut Hal) -> T) -> T {
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

struct Module {
    main: unsafe extern "C" fn() -> c_int,
    exit: unsafe extern "C" fn(),
    forward: Forward,
    inverse: Inverse,
    kind: unsafe extern "C" fn() -> c_int,
    switchable: unsafe extern "C" fn() -> c_int,
    switch: unsafe extern "C" fn(c_int) -> c_int,
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
    fn open(name: &str) -> Self {
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
    fn load(&self, machine: &str) -> c_int {
        let machine = CString::new(machine).unwrap();
        unsafe {
            self.machine.write(machine.into_raw());
            (self.main)()
        }
    }

    fn inverse(&self, pose: &[f64; 9]) -> Result<Joints, c_int> {
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

    fn forward(&self, joints: &Joints, seed: &[f64; 9]) -> Result<[f64; 9], c_int> {
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

fn setp(name: &str, value: f64) {
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

fn pin(name: &str) -> u32 {
    let (place, kind) = hal(|hal| hal.names[name]);
    assert_eq!(kind, Kind::U32Pin);
    unsafe { (place as *const u32).read_volatile() }
}

fn messages() -> Vec<String> {
    hal(|hal| std::mem::take(&mut hal.messages))
}

/// A second passes.
fn wait() {
    hal(|hal| hal.time_ns += 1_000_000_000);
}

/// More calls than it takes to look at all of the geometry.
const ENOUGH: usize = 10;

// ---- tests --------------------------------------------------------------------------------------------------------------------

/// A Rust mechanism in LinuxCNC's units.
fn own_inverse(mechanism: &Mechanism, pose: &[f64; 9]) -> Result<Joints, InverseError> {
    let mut inner = Pose::from_array(*pose);
    [inner.a, inner.b, inner.c] = [inner.a, inner.b, inner.c].map(maths::radians);
    let mut joints = mechanism.inverse(&inner)?;
    for (joint, value) in joints.iter_mut().enumerate() {
        if mechanism.joint_kind(joint) == JointKind::Rotary && joint < mechanism.joint_count() {
            *value = maths::degrees(*value);
        }
    }
    Ok(joints)
}

/// Loads a shipped machine and compares the module with the mechanism, bit for bit, in a box about a pose.
fn same_as<M: mechanism::Mechanism>(module: &str, names: usize, own: impl Fn(&M::Parameters) -> Mechanism) {
    let loaded = Module::open(module);
    for (name, parameters) in M::SHIPPED {
        *HAL.lock().unwrap() = Some(Hal::default());
        assert_eq!(loaded.load(name), 0, "{module} {name}");
        assert!(hal(|hal| hal.ready && !hal.exited));
        assert_eq!(
            hal(|hal| hal.names.len()),
            names,
            "{:?}",
            hal(|hal| hal.names.keys().cloned().collect::<Vec<_>>())
        );
        assert!(hal(|hal| hal.names.keys().all(|name| name.starts_with(&format!("{}.", M::PREFIX)))));
        assert_eq!(unsafe { (loaded.kind)() }, 4);
        assert_eq!(unsafe { (loaded.switchable)() }, c_int::from(M::TYPES > 1));
        let mechanism = own(&parameters());
        let count = mechanism.joint_count();
        let mut random = 1_u64;
        let mut unit = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let (mut reached, mut refused) = (0, 0);
        for _ in 0..4000 {
            let mut pose = [0.0; 9];
            for axis in mechanism.axes().iter() {
                // Some modes of the HV-Mill have their angles locked at 0.
                let angle = if unit() < 0.0 { 0.0 } else { 30.0 };
                pose[axis as usize] = unit() * if axis.is_rotary() { angle } else { 400.0 };
            }
            if module == "lambda_kins" {
                pose[2] = -1500.0 + 0.5 * pose[2];
            }
            match (loaded.inverse(&pose), own_inverse(&mechanism, &pose)) {
                (Ok(theirs), Ok(ours)) => {
                    reached += 1;
                    let bits = |joints: &Joints| joints.map(|joint| joint.to_bits())[..count].to_vec();
                    assert_eq!(bits(&theirs), bits(&ours), "{module} {name} {pose:?}");
                    if let Ok(back) = loaded.forward(&ours, &pose) {
                        let most = (0..9).map(|i| (back[i] - pose[i]).abs()).fold(0.0, f64::max);
                        let Ok(s) = mechanism.singularity(&Pose::from_array(pose)) else { continue };
                        assert!(
                            most < 1e-5 || s.forward < 0.05 || s.inverse < 0.01,
                            "{module} {name} {pose:?}: {back:?}"
                        );
                    }
                }
                (Err(-1), Err(_)) => refused += 1,
                (theirs, ours) => panic!("{module} {name} {pose:?}: {theirs:?} {ours:?}"),
            }
            let _ = messages();
        }
        // A hexapod without limits reaches everything.
        assert!(
            reached > 30 && (refused > 0 || module == "hexapod_kins"),
            "{module} {name}: {reached} reached, {refused} refused"
        );
        unsafe { (loaded.exit)() };
        assert!(hal(|hal| hal.exited));
    }
}

#[test]
fn every_module_calculates_as_the_crate() {
    same_as::<Moma>("moma_kins", 13, |p| Moma::new(p).unwrap().into());
    same_as::<Moma4s>("moma_4s_kins", 21, |p| Moma4s::new(p).unwrap().into());
    same_as::<MomaW>("moma_w_kins", 50, |p| MomaW::new(p).unwrap().into());
    same_as::<Planar>("planar_kins", 17, |p| Planar::new(p).unwrap().into());
    same_as::<Lambda6>("lambda_kins", 20, |p| Lambda6::new(p).unwrap().into());
    same_as::<LinearDelta>("delta_kins", 3, |p| LinearDelta::new(p).unwrap().into());
    same_as::<Hexapod>("hexapod_kins", 38, |p| Hexapod::new(p).unwrap().into());
    same_as::<HvMill>("hv_mill_kins", 34, |p| HvMill::new(p).unwrap().into());
}

#[test]
fn o_x_glide_keeps_away_from_the_form_switch() {
    let glide = Module::open("ox_glide_kins");
    assert_eq!(glide.load("ox-glide-o"), 0);
    let own = OxGlide::new(&OxForm::O.into()).unwrap();
    let pose = [65.0, 66.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joints = glide.inverse(&pose).unwrap();
    assert_eq!(joints, own.inverse(&Pose::from_array(pose)).unwrap());
    // c = √(80² − 79.99²) = 1.26 mm: nearer than 2 mm.
    assert_eq!(glide.inverse(&[65.0, 79.99, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Err(-1));
    assert!(messages()[0].contains("form switch"));
    assert!(
        mechanism::Mechanism::inverse(
            &mut <OxGlideKins as mechanism::Mechanism>::new(&OxForm::O.into(), None).unwrap(),
            &Pose { y: 79.99, ..Pose::ZERO },
            &mut [0.0; MAX_JOINTS]
        )
        .is_err()
    );
}

#[test]
fn the_form_is_switched_through_joint_mode() {
    let glide = Module::open("ox_glide_kins");
    assert_eq!(glide.load("ox-glide-o"), 0);
    let pose = [65.0, 65.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joints = glide.inverse(&pose).unwrap();
    assert_eq!(glide.inverse(&pose), Ok(joints));
    // The sliders stand in the O form: X is refused, joint mode is not.
    assert_eq!(unsafe { (glide.switch)(1) }, -1);
    assert!(messages()[0].contains("other form"));
    assert_eq!(glide.inverse(&pose), Ok(joints), "a refused switch changes nothing");
    assert_eq!(unsafe { (glide.switch)(2) }, 0);
    let here = glide.forward(&joints, &pose).unwrap();
    assert_eq!(here[..3], joints[..3]);
    // AB' = CD − s, CD' = AB + s
    let there = [joints[1] - 20.0, joints[0] + 20.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    glide.inverse(&here).unwrap();
    let moved = glide.inverse(&there).unwrap();
    wait();
    assert_eq!(unsafe { (glide.switch)(1) }, -1, "moving");
    assert!(messages()[0].contains("at rest"));
    assert_eq!(glide.inverse(&there), Ok(moved));
    assert_eq!(unsafe { (glide.switch)(1) }, 0);
    let crossed = glide.forward(&moved, &there).unwrap();
    for (axis, &coordinate) in crossed[..3].iter().zip(&pose[..3]) {
        assert!((axis - coordinate).abs() < 1e-9, "{crossed:?}");
    }
    assert_eq!(unsafe { (glide.switch)(3) }, -1);
}

#[test]
fn hv_mill_switches_and_holds() {
    let mill = Module::open("hv_machine_kins");
    assert_eq!(mill.load("hv-mill-7"), 0);
    assert_eq!(unsafe { (mill.switchable)() }, 1);
    // Joints driven one by one, before the pose is: the idle mechanism holds what it finds.
    let mut joints = [0.0; MAX_JOINTS];
    joints[..7].copy_from_slice(&[101.0, 99.0, 90.0, 95.0, 100.0, 10.0, 5.0]);
    let mut pose = [0.0; 9];
    for _ in 0..5 {
        pose = mill.forward(&joints, &pose).unwrap();
    }
    let back = mill.inverse(&pose).unwrap();
    for (a, b) in back.iter().zip(&joints) {
        assert!((a - b).abs() < 1e-9, "{back:?}");
    }
    assert_eq!(back[2..4], joints[2..4]);
    assert_eq!(back[6], 5.0);
    // C, U, V and W are V's: while H is active they stay.
    let mut idle = pose;
    idle[6] += 1.0;
    assert_eq!(mill.inverse(&idle), Err(-1));
    assert!(messages()[0].contains("does not move with the mechanism"));
    // Nothing moves when V takes over.
    assert_eq!(mill.inverse(&pose), Ok(back));
    assert_eq!(mill.inverse(&pose), Ok(back));
    assert_eq!(unsafe { (mill.switch)(1) }, 0);
    let vertical = mill.forward(&back, &pose).unwrap();
    assert_eq!(vertical[..3], pose[..3], "coordinates of H stay");
    let again = mill.inverse(&vertical).unwrap();
    for (a, b) in again.iter().zip(&back) {
        assert!((a - b).abs() < 1e-9, "{again:?} {back:?}");
    }
    // And V moves without H.
    let mut other = vertical;
    other[6] += 3.0;
    other[8] += 2.0;
    let moved = mill.inverse(&other).unwrap();
    assert_eq!(moved[..2], again[..2]);
    assert!((moved[2] - again[2]).abs() > 0.1);
    wait();
    assert_eq!(unsafe { (mill.switch)(0) }, -1, "moving");
    assert!(messages()[0].contains("at rest"));
    assert_eq!(unsafe { (mill.switch)(2) }, -1);
}

#[test]
fn geometry_not_set_refuses_every_pose() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load(""), 0);
    assert_eq!(messages(), [""; 0], "loading alone is no error");
    let pose = [0.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(moma.inverse(&pose), Err(-1));
    let told = messages();
    assert!(told.len() == 1 && told[0].contains("moma_kins: the geometry is not set"), "{told:?}");
    assert_eq!(moma.forward(&[1.0; MAX_JOINTS], &pose), Err(-1));
    // As geometry.hal does: one after the other.
    for (drive, x, angle) in [("1", -100.0, 265.0), ("2", 100.0, 275.0)] {
        for (name, value) in [
            ("reference-x", x),
            ("reference-y", 0.0),
            ("rail-angle", angle),
            ("link-length", 195.0),
            ("working-mode", -1.0),
        ] {
            setp(&format!("moma.{drive}.{name}"), value);
        }
    }
    setp("moma.assembly", -1.0);
    for _ in 0..ENOUGH {
        let _ = moma.inverse(&pose);
    }
    let own = Moma::new(&MomaConfiguration::A.into()).unwrap();
    assert_eq!(moma.inverse(&pose), Ok(own.inverse(&Pose::from_array(pose)).unwrap()));
}

#[test]
fn nonsense_while_running_is_refused_until_it_is_gone() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load("moma-a"), 0);
    let pose = [10.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joints = moma.inverse(&pose).unwrap();
    let refused = |name: &str, value: f64, before: f64, why: &str| {
        wait();
        setp(name, value);
        for _ in 0..ENOUGH {
            let _ = moma.inverse(&pose);
        }
        assert_eq!(moma.inverse(&pose), Err(-1), "{name} = {value}");
        assert_eq!(moma.forward(&joints, &pose), Err(-1), "{name} = {value}");
        let told = messages();
        assert!(told.len() == 1 && told[0].contains(why), "{name} = {value}: {told:?}");
        setp(name, before);
        for _ in 0..ENOUGH {
            let _ = moma.inverse(&pose);
        }
        assert_eq!(moma.inverse(&pose), Ok(joints), "{name} is back");
        let _ = messages();
    };
    refused("moma.1.link-length", f64::NAN, 195.0, "is no number");
    refused("moma.1.link-length", f64::INFINITY, 195.0, "is no number");
    refused("moma.1.link-length", -195.0, 195.0, "makes no mechanism");
    refused("moma.1.link-length", 0.0, 195.0, "makes no mechanism");
    refused("moma.1.link-length", 1e300, 195.0, "makes no mechanism");
    refused("moma.2.working-mode", 0.0, -1.0, "must be 1 or -1");
    refused("moma.2.working-mode", 1e9, -1.0, "is too large");
    refused("moma.assembly", 5.0, -1.0, "must be 1 or -1");
    // A mechanism, but another one: the machine would jump.
    refused("moma.1.link-length", 196.0, 195.0, "would jump");
    refused("moma.2.working-mode", 1.0, -1.0, "");
    refused("moma.1.link-length", 20.0, 195.0, "too short");
    // A correction is no jump.
    setp("moma.1.link-length", 195.1);
    for _ in 0..ENOUGH {
        assert!(moma.inverse(&pose).is_ok());
    }
    assert!(moma.inverse(&pose).unwrap()[0] != joints[0]);
    // While LinuxCNC does not drive the pose any geometry may be set.
    for _ in 0..4 {
        moma.forward(&joints, &pose).unwrap();
    }
    setp("moma.1.link-length", 205.0);
    for _ in 0..ENOUGH {
        assert!(moma.forward(&joints, &pose).is_ok());
    }
    assert!(moma.inverse(&pose).is_ok());
    assert_eq!(messages(), [""; 0]);
}

#[test]
fn errors_are_counted_and_told_once_a_second() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load("moma-a"), 0);
    let far = [500.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut joints = [7.5; 16];
    for _ in 0..1000 {
        let status =
            unsafe { (moma.inverse)(&far, joints.as_mut_ptr(), std::ptr::null(), std::ptr::null_mut()) };
        assert_eq!(status, -1);
    }
    assert_eq!(joints, [7.5; 16], "a refused pose writes nothing");
    assert_eq!(pin("moma.errors"), 1000);
    let told = messages();
    assert!(told.len() == 1 && told[0].contains("joint %d: its link is %.3f mm too short"), "{told:?}");
    wait();
    assert_eq!(moma.inverse(&far), Err(-1));
    assert_eq!(messages().len(), 1);
    for nonsense in [f64::NAN, f64::INFINITY, f64::MAX] {
        assert_eq!(moma.inverse(&[nonsense, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Err(-1));
        assert_eq!(moma.forward(&[nonsense; MAX_JOINTS], &far), Err(-1));
    }
}

#[test]
fn lambda_counts_its_iterations() {
    let lambda = Module::open("lambda_kins");
    assert_eq!(lambda.load("lambda6"), 0);
    let pose = [20.0, -30.0, -1480.0, 3.0, -4.0, 5.0, 0.0, 0.0, 0.0];
    let joints = lambda.inverse(&pose).unwrap();
    let mut near = pose;
    near[0] += 0.1;
    let found = lambda.forward(&joints, &near).unwrap();
    assert!((0..6).all(|i| (found[i] - pose[i]).abs() < 1e-6), "{found:?}");
    let warm = pin("lambda.last-iterations");
    assert!((1..=3).contains(&warm), "{warm}");
    let mut far = pose;
    far[0] -= 90.0;
    far[5] += 20.0;
    lambda.forward(&joints, &far).unwrap();
    let cold = pin("lambda.last-iterations");
    assert!(cold > warm, "{cold}");
    lambda.forward(&joints, &pose).unwrap();
    assert_eq!(pin("lambda.max-iterations"), cold);
    assert!(pin("lambda.last-iterations") <= 1);
    // Joints at which no mechanism stands, before anything is known, are not told.
    assert_eq!(lambda.forward(&[0.0; MAX_JOINTS], &pose), Err(-1));
    assert_eq!(messages(), [""; 0]);
}

#[test]
fn a_module_that_cannot_be_made_says_so_and_leaves() {
    let moma = Module::open("moma_kins");
    assert_eq!(moma.load("no-such-machine"), -22);
    assert!(messages()[0].contains("no machine of the name"));
    assert!(!hal(|hal| hal.ready));
    hal(|hal| hal.refuse_malloc = true);
    assert_eq!(moma.load("moma-a"), -12);
    assert!(hal(|hal| hal.exited && !hal.ready));
    hal(|hal| {
        *hal = Hal { refuse_name: Some("moma.2.rail-angle".into()), ..Hal::default() };
    });
    assert_eq!(moma.load("moma-a"), -22);
    assert!(hal(|hal| hal.exited && !hal.ready));
    // And after all that it can still be loaded.
    *HAL.lock().unwrap() = Some(Hal::default());
    assert_eq!(moma.load("moma-a"), 0);
    assert!(moma.inverse(&[0.0, -265.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_ok());
}
