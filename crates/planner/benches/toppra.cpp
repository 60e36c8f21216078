// toppra's own C++ library on P01 and P03 (a line and a circle on a MOMA), on 500 equal intervals: `case us_per_node s`, the
// median of 101 solutions. Path and kinematics are evaluated, as the planner's are; see toppra.py.
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

struct Vec {
  double x, y;
};
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y}; }
Vec operator*(double k, Vec a) { return {k * a.x, k * a.y}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y; }

// Sliders p on rails at 265 and 275 degrees from (-100, 0) and (100, 0), links of 195 mm: |X - R - p u| = l.
struct Moma : GeometricPath {
  double length;
  Vec rail[2] = {{std::cos(265 * M_PI / 180), std::sin(265 * M_PI / 180)},
                 {std::cos(275 * M_PI / 180), std::sin(275 * M_PI / 180)}};
  Vec from[2] = {{-100, 0}, {100, 0}};

  explicit Moma(double length) : GeometricPath(2), length(length) {}
  virtual void tool(double s, Vec &x, Vec &first, Vec &second) const = 0;
  Bound pathInterval() const override { return Bound(0, length); }

  Vector eval_single(value_type s, int order) const override {
    Vec x, first, second;
    tool(s, x, first, second);
    Vector q(2);
    for (int i = 0; i < 2; ++i) {
      const Vec r = x - from[i], u = rail[i];
      const double along = dot(r, u), p = along - std::sqrt(along * along - dot(r, r) + 195.0 * 195.0);
      const Vec link = r - p * u;
      const double reach = dot(link, u), p1 = dot(link, first) / reach;
      const Vec swing = first - p1 * u;
      q[i] = order == 0 ? p : order == 1 ? p1 : (dot(swing, swing) + dot(link, second)) / reach;
    }
    return q;
  }
};

struct Line : Moma {
  Line() : Moma(100) {}
  void tool(double s, Vec &x, Vec &first, Vec &second) const override {
    x = {-50 + s, -270};
    first = {1, 0};
    second = {0, 0};
  }
};

struct Circle : Moma {
  Circle() : Moma(80 * M_PI) {}
  void tool(double s, Vec &x, Vec &first, Vec &second) const override {
    const double c = std::cos(s / 40), d = std::sin(s / 40);
    x = {40 * c, -265 + 40 * d};
    first = {-d, c};
    second = {-c / 40, -d / 40};
  }
};

void run(const char *name, const std::shared_ptr<Moma> &path) {
  const int intervals = 500;
  const Vector s = Vector::LinSpaced(intervals + 1, 0, path->length);
  const Vector v = Vector::Constant(2, 100), a = Vector::Constant(2, 1000);
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
  run("P01", std::make_shared<Line>());
  run("P03", std::make_shared<Circle>());
}
