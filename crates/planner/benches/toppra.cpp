// toppra's own C++ library on P01, P03 (a line and a circle on a MOMA), P10 (a circle on a linear delta) and P12 (a line of a
// hexapod), on 500 equal intervals: `case us_per_node s`, the median of 101 solutions. Path and kinematics are evaluated, as the
// planner's are; see toppra.py.
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <toppra/algorithm/toppra.hpp>
#include <toppra/constraint/linear_joint_acceleration.hpp>
#include <toppra/constraint/linear_joint_velocity.hpp>
#include <toppra/geometric_path.hpp>
#include <toppra/solver/seidel.hpp>
#include <vector>

using namespace toppra;
using Eigen::Vector3d;

Vector3d around(double degrees, double radius) {
  return {radius * std::cos(degrees * M_PI / 180), radius * std::sin(degrees * M_PI / 180), 0};
}

// Where the tool is at s, with its derivatives; A, B, C only on the hexapod, and only evenly.
struct Place {
  Vector3d x, first, second = Vector3d::Zero();
  Vector3d angles = Vector3d::Zero(), rates = Vector3d::Zero();
};

Place line(const Vector3d &from, const Vector3d &direction, double s) { return {from + s * direction, direction}; }

Place circle(const Vector3d &centre, double r, double s) {
  const double c = std::cos(s / r), d = std::sin(s / r);
  return {centre + Vector3d(r * c, r * d, 0), {-d, c, 0}, {-c / r, -d / r, 0}};
}

// Joint `i` at a place, or its derivative of the order asked for.
struct Moma {
  static constexpr int joints = 2;
  Eigen::Vector2d rail[2] = {around(265, 1).head<2>(), around(275, 1).head<2>()}, from[2] = {{-100, 0}, {100, 0}};
  double l = 195;

  void at(const Place &p, int order, Vector &q) const {
    for (int i = 0; i < joints; ++i) {
      // |X - R - p u| = l
      const Eigen::Vector2d r = p.x.head<2>() - from[i], v = p.first.head<2>();
      const double along = r.dot(rail[i]), travel = along - std::sqrt(along * along - r.squaredNorm() + l * l);
      const Eigen::Vector2d link = r - travel * rail[i];
      const double reach = link.dot(rail[i]), rate = link.dot(v) / reach;
      q[i] = order == 0   ? travel
             : order == 1 ? rate
                          : ((v - rate * rail[i]).squaredNorm() + link.dot(p.second.head<2>())) / reach;
    }
  }
};

struct Delta {
  static constexpr int joints = 3;
  Vector3d column[3] = {around(210, 105), around(330, 105), around(90, 105)};
  double l = 217;

  void at(const Place &p, int order, Vector &q) const {
    for (int i = 0; i < joints; ++i) {
      const Eigen::Vector2d d = (p.x - column[i]).head<2>(), v = p.first.head<2>();
      const double h = std::sqrt(l * l - d.squaredNorm()), h1 = -d.dot(v) / h;
      q[i] = order == 0   ? p.x.z() + h
             : order == 1 ? p.first.z() + h1
                          : p.second.z() - (v.squaredNorm() + d.dot(p.second.head<2>()) + h1 * h1) / h;
    }
  }
};

struct Hexapod {
  static constexpr int joints = 6;
  Vector3d base[6], platform[6];

  Hexapod() {
    for (int i = 0; i < joints; ++i) {
      const int side = i % 2 ? 1 : -1;
      base[i] = around(120 * (i / 2) + side * 10, 120);
      platform[i] = around(120 * (i / 2) + side * 50, 60);
    }
  }

  void at(const Place &p, int order, Vector &q) const {
    // R = Rz(c) Ry(b) Rx(a); the rates turn about x, y and z as the turns after them leave these.
    const Eigen::Matrix3d z = Eigen::AngleAxisd(p.angles.z(), Vector3d::UnitZ()).toRotationMatrix(),
                          zy = z * Eigen::AngleAxisd(p.angles.y(), Vector3d::UnitY()).toRotationMatrix(),
                          r = zy * Eigen::AngleAxisd(p.angles.x(), Vector3d::UnitX()).toRotationMatrix();
    const Vector3d about_z = p.rates.z() * Vector3d::UnitZ(), about_y = p.rates.y() * z.col(1), about_x = p.rates.x() * zy.col(0);
    const Vector3d omega = about_z + about_y + about_x,
                   alpha = about_z.cross(about_y) + (about_z + about_y).cross(about_x);
    for (int i = 0; i < joints; ++i) {
      const Vector3d arm = r * platform[i], d = p.x + arm - base[i];
      const double length = d.norm();
      if (order == 0) {
        q[i] = length;
        continue;
      }
      const Vector3d swing = omega.cross(arm), v = p.first + swing;
      const double rate = d.dot(v) / length;
      if (order == 1) {
        q[i] = rate;
        continue;
      }
      const Vector3d a = p.second + alpha.cross(arm) + omega.cross(swing);
      q[i] = (v.squaredNorm() + d.dot(a) - rate * rate) / length;
    }
  }
};

template <class Machine, class Tool> struct Path : GeometricPath {
  Machine machine;
  double length;
  Tool tool;

  Path(double length, Tool tool) : GeometricPath(Machine::joints), length(length), tool(tool) {}
  Bound pathInterval() const override { return Bound(0, length); }
  Vector eval_single(value_type s, int order) const override {
    Vector q(Machine::joints);
    machine.at(tool(s), order, q);
    return q;
  }
};

template <class Machine, class Tool>
void run(const char *name, double length, double v_max, double a_max, Tool tool) {
  const int intervals = 500;
  const std::shared_ptr<GeometricPath> path = std::make_shared<Path<Machine, Tool>>(length, tool);
  const Vector s = Vector::LinSpaced(intervals + 1, 0, length);
  const Vector v = Vector::Constant(Machine::joints, v_max), a = Vector::Constant(Machine::joints, a_max);
  std::vector<double> spent_us;
  double duration = 0;
  for (int repeat = 0; repeat < 101; ++repeat) {
    const auto begin = std::chrono::steady_clock::now();
    algorithm::TOPPRA problem({std::make_shared<constraint::LinearJointVelocity>(-v, v),
                               std::make_shared<constraint::LinearJointAcceleration>(-a, a)}, path);
    problem.setGridpoints(s);
    problem.solver(std::make_shared<solver::Seidel>());
    // As it comes, it takes 100 for the largest speed squared there is.
    problem.setInitialXBounds(Bound(0, 1e8));
    const auto code = problem.computePathParametrization(0, 0);
    const std::chrono::duration<double, std::micro> spent = std::chrono::steady_clock::now() - begin;
    if (code != ReturnCode::OK) {
      std::cerr << name << ": " << problem.getErrorMessage() << "\n";
      std::exit(1);
    }
    spent_us.push_back(spent.count());
    const Vector &x = problem.getParameterizationData().parametrization;
    duration = 0;
    for (int i = 0; i < intervals; ++i) duration += 2 * (s[i + 1] - s[i]) / (std::sqrt(x[i]) + std::sqrt(x[i + 1]));
  }
  std::nth_element(spent_us.begin(), spent_us.begin() + spent_us.size() / 2, spent_us.end());
  std::cout << name << " " << spent_us[spent_us.size() / 2] / intervals << " " << duration << std::endl;
}

int main() {
  run<Moma>("P01", 100, 100, 1000, [](double s) { return line({-50, -270, 0}, {1, 0, 0}, s); });
  run<Moma>("P03", 80 * M_PI, 100, 1000, [](double s) { return circle({0, -265, 0}, 40, s); });
  run<Delta>("P10", 160 * M_PI, 200, 3000, [](double s) { return circle({0, 0, 20}, 80, s); });
  const Vector3d low(-30, -20, 150), high(30, 20, 170), turn = Vector3d(10, -6, 10) * M_PI / 180;
  const double length = (high - low).norm();
  const Vector3d direction = (high - low) / length, start = Vector3d(-5, 3, 0) * M_PI / 180;
  run<Hexapod>("P12", length, 100, 1000, [=](double s) {
    Place place = line(low, direction, s);
    place.rates = turn / length;
    place.angles = start + s * place.rates;
    return place;
  });
}
