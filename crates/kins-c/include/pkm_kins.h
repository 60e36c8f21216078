// The kinematics of pkm for C. Generated from crates/kins-c by cbindgen; do not edit (PKM_BLESS=1 cargo test -p pkm-kins-c).

#ifndef PKM_KINS_H
#define PKM_KINS_H

#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

// Joints of the largest machine. Every joint array given to a function has this many places; of those a function fills it
// touches only the machine's joints.
#define PKM_MAX_JOINTS 9

// Words in a machine's storage.
#define PKM_MACHINE_WORDS 128

// What a call came to.
typedef enum {
  // Done.
  PKM_STATUS_OK = 0,
  // A pointer is NULL, or the machine was not made by a constructor.
  PKM_STATUS_USAGE = -1,
  // The parameters make no mechanism.
  PKM_STATUS_GEOMETRY = -2,
  // The pose has no joints, or the joints no pose.
  PKM_STATUS_KINEMATICS = -3,
} PkmStatus;

// A machine, ready to run. Opaque: made by a constructor such as `pkm_moma`.
typedef struct {
  uint64_t made;
  // Bit i: joint i is rotary; `ROTARY_AXIS`: the pose has angles. 0: nothing of the machine is in degrees.
  uint32_t degrees;
  uint32_t joint_count;
  uint64_t words[PKM_MACHINE_WORDS];
} PkmMachine;

// A general planar mechanism: two sliders, two links, platform joints offset from the controlled point.
typedef struct {
  double reference_mm[2][2];
  double guide_angle_deg[2];
  double l_mm[2];
  double offset_mm[2][2];
  int8_t working_mode[2];
  int8_t assembly;
  bool one_sided;
} PkmPlanar;

// Why a call failed: a code such as `unreachable:1` and a sentence, both ending in 0.
typedef struct {
  char code[32];
  char message[224];
} PkmError;

// MOMA.
typedef struct {
  double reference_mm[2][2];
  double guide_angle_deg[2];
  double l_mm[2];
  int8_t working_mode[2];
  int8_t assembly;
  bool one_sided;
} PkmMoma;

// MOMA 4S.
typedef struct {
  double pivot_mm[2][2];
  double rho_mm[2][2];
  double gamma_deg[2];
  double l_mm[2];
  double l_h_mm[2];
  double l_t_mm;
  double alpha_t_deg;
  int8_t working_mode[2];
  int8_t assembly;
  bool one_sided;
} PkmMoma4s;

// MOMA-W. A wire limit of 0 is none.
typedef struct {
  PkmMoma4s mechanism[2];
  double b_mm[3];
  double w_mm[3];
  double contour_distance_mm;
  double max_wire_length_mm;
  double max_wire_tilt_deg;
} PkmMomaW;

// One mechanism of the HV-Mill alone, `spindle` `'H'` or `'V'`; `controlled_axes` 3 (no rotary axis), 4 (table) or 5 (table and
// head, V only).
typedef struct {
  uint8_t spindle;
  uint8_t controlled_axes;
  PkmMoma4s mechanism;
  double cr_mm[3];
  double w0_mm[3];
  int8_t table_sense;
  // V only.
  bool has_head;
  double head_c_mm[3];
  int8_t head_sense;
} PkmHvMill;

// The HV-Mill with both mechanisms. Array entry 0 is H, 1 is V.
typedef struct {
  PkmMoma4s mechanism[2];
  double cr_mm[2][3];
  double w0_mm[2][3];
  int8_t table_sense[2];
  double rest_mm[2][2];
  // Seven joints (fig 2b) with a tilting head, else six (fig 2a).
  bool has_head;
  double head_c_mm[3];
  int8_t head_sense;
  // `'H'` or `'V'`: active at start.
  uint8_t active;
} PkmHvMachine;

// O-X glide; `form` is `'O'` or `'X'`.
typedef struct {
  double l_mm;
  double s_mm;
  uint8_t form;
  double c_min_mm;
} PkmOxGlide;

// Lambda. `spacing_mm` of {0, 0} and a cone of 0 are no limits.
typedef struct {
  double base_radius_mm;
  double platform_radius_mm;
  double c_mm[3];
  double r_mm[3];
  double u_mm[3];
  double yaw_offset_deg;
  int8_t assembly;
  double spacing_mm[2];
  double platform_cone_deg;
  double sigma_min;
} PkmLambda6;

// Linear delta.
typedef struct {
  double joint_radius_mm;
  double joint_length_mm;
} PkmLinearDelta;

// Hexapod.
typedef struct {
  double base_mm[6][3];
  double platform_mm[6][3];
  double start_z_mm;
} PkmHexapod;

// A pose: mm and degrees, laid out as LinuxCNC's `EmcPose`.
typedef struct {
  double x;
  double y;
  double z;
  double a;
  double b;
  double c;
  double u;
  double v;
  double w;
} PkmPose;

// How near a pose is to a singularity: 1 far, 0 there.
typedef struct {
  // Smallest over the joints, type 1.
  double inverse;
  // That joint, from 0.
  uintptr_t inverse_joint;
  // Type 2.
  double forward;
} PkmSingularity;

// Travel of a joint (mm, degrees), both ends included.
typedef struct {
  double min;
  double max;
} PkmRange;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Makes a general planar mechanism. `error` may be NULL.
PkmStatus pkm_planar(PkmMachine *machine, const PkmPlanar *parameters, PkmError *error);

// Makes a MOMA. `error` may be NULL.
PkmStatus pkm_moma(PkmMachine *machine, const PkmMoma *parameters, PkmError *error);

// Makes a MOMA 4S. `error` may be NULL.
PkmStatus pkm_moma_4s(PkmMachine *machine, const PkmMoma4s *parameters, PkmError *error);

// Makes a MOMA-W. `error` may be NULL.
PkmStatus pkm_moma_w(PkmMachine *machine, const PkmMomaW *parameters, PkmError *error);

// Makes one mechanism of the HV-Mill with carriage, table and head. `error` may be NULL.
PkmStatus pkm_hv_mill(PkmMachine *machine, const PkmHvMill *parameters, PkmError *error);

// Makes an HV-Mill with both mechanisms. `error` may be NULL.
PkmStatus pkm_hv_machine(PkmMachine *machine, const PkmHvMachine *parameters, PkmError *error);

// Makes an O-X glide. `error` may be NULL.
PkmStatus pkm_ox_glide(PkmMachine *machine, const PkmOxGlide *parameters, PkmError *error);

// Makes a Lambda. `error` may be NULL.
PkmStatus pkm_lambda6(PkmMachine *machine, const PkmLambda6 *parameters, PkmError *error);

// Makes a linear delta. `error` may be NULL.
PkmStatus pkm_linear_delta(PkmMachine *machine, const PkmLinearDelta *parameters, PkmError *error);

// Makes a hexapod. `error` may be NULL.
PkmStatus pkm_hexapod(PkmMachine *machine, const PkmHexapod *parameters, PkmError *error);

// Makes a Cartesian machine with the axes of `letters` (a subset of "XYZABCUVW").
PkmStatus pkm_cartesian(PkmMachine *machine, const char *letters, PkmError *error);

// Parameters of MOMA's configuration `'a'`, `'b'`, `'c'` or `'d'`.
PkmStatus pkm_moma_parameters(PkmMoma *parameters, uint8_t name);

// Parameters of MOMA 4S: 0 is P, 5 and 10 are S5 and S10, −5 and −10 U5 and U10. Inferred dimensions.
PkmStatus pkm_moma_4s_parameters(PkmMoma4s *parameters,
                                 int32_t outward_deg);

// Default parameters of MOMA-W. Inferred dimensions.
PkmStatus pkm_moma_w_parameters(PkmMomaW *parameters);

// Default parameters of one mechanism of the HV-Mill: `'H'` with 3 or 4 axes, `'V'` with 3, 4 or 5. Inferred dimensions.
PkmStatus pkm_hv_mill_parameters(PkmHvMill *parameters,
                                 uint8_t spindle,
                                 uint8_t controlled_axes);

// Default parameters of the HV-Mill with head (fig 2b). Inferred dimensions.
PkmStatus pkm_hv_machine_parameters(PkmHvMachine *parameters);

// Default parameters of Lambda (set yaw45). Inferred dimensions.
PkmStatus pkm_lambda6_parameters(PkmLambda6 *parameters);

// Number of joints; 0 for a machine that was never made.
uintptr_t pkm_joint_count(const PkmMachine *machine);

// Pose → joints. `error` may be NULL.
PkmStatus pkm_inverse(const PkmMachine *machine,
                      const PkmPose *pose,
                      double *joints,
                      PkmError *error);

// Joints → pose. `pose` holds a pose nearby (the seed; all zeros: none) and receives the answer. `error` may be NULL.
PkmStatus pkm_forward(const PkmMachine *machine,
                      const double *joints,
                      PkmPose *pose,
                      PkmError *error);

// ∂joints/∂pose: 9 × 9 numbers, rows joints, columns X Y Z A B C U V W; angular columns per degree, rotary rows in degrees.
PkmStatus pkm_jacobian(const PkmMachine *machine,
                       const PkmPose *pose,
                       double (*rows)[PKM_MAX_JOINTS],
                       PkmError *error);

// Joint rates and accelerations (degrees for rotary joints) of a pose moving with `velocity` and `acceleration`.
PkmStatus pkm_motion(const PkmMachine *machine,
                     const PkmPose *pose,
                     const PkmPose *velocity,
                     const PkmPose *acceleration,
                     double *joint_velocity,
                     double *joint_acceleration,
                     PkmError *error);

// Distance from singularities.
PkmStatus pkm_singularity(const PkmMachine *machine,
                          const PkmPose *pose,
                          PkmSingularity *measures,
                          PkmError *error);

// HV-Mill: makes `'H'` or `'V'` the active mechanism while the machine stands at `joints`; `pose` is updated. Nothing moves.
PkmStatus pkm_switch(PkmMachine *machine,
                     uint8_t to,
                     const double *joints,
                     PkmPose *pose,
                     PkmError *error);

// O-X glide: the joint move that takes the machine, standing at `joints`, from its form to the other one. Checked: both ends of the
// move outside the guard and within `travel` (three: AB, CD, Z; NULL: no limits). `end` may be `joints`. Written: `end`, where to drive the sliders linearly and
// together; `pose`, where the platform is before and after; `after`, the machine once the move is done (may be `machine` itself).
// Nothing moves, and after an error nothing is written.
PkmStatus pkm_form_switch(const PkmMachine *machine,
                          const double *joints,
                          const PkmRange *travel,
                          double *end,
                          PkmPose *pose,
                          PkmMachine *after,
                          PkmError *error);

// Chooses the machine of `kinematicsForward` and `kinematicsInverse`; it must outlive their use. NULL chooses none.
void pkm_use(PkmMachine *machine);

// As LinuxCNC's: joints → world, with the world's old value as seed. 0, or −1 if there is no answer. The flags are not used.
int kinematicsForward(const double *joint,
                      PkmPose *world,
                      const unsigned long *_fflags,
                      unsigned long *_iflags);

// As LinuxCNC's: world → joints. 0, or −1 if there is no answer. The flags are not used.
int kinematicsInverse(const PkmPose *world,
                      double *joint,
                      const unsigned long *_iflags,
                      unsigned long *_fflags);

// As LinuxCNC's: 4, `KINEMATICS_BOTH`.
int kinematicsType(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PKM_KINS_H */
