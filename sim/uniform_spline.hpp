// A smooth curve over time or path length, from equidistant control points.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace understory::sim {

/// A uniform B-spline of degree 5: four continuous derivatives. Control point k belongs to
/// parameter k * step and attracts the curve (the curve is a smoothed version of the points: where
/// they bend by p'', its distance from them is p'' step^2 / 4). Beyond the ends it stays at the end
/// points.
template <int N>
class UniformSpline {
 public:
  /// A point of the curve.
  using Vector = Eigen::Matrix<double, N, 1>;
  /// The curve at one parameter.
  struct Value {
    Vector position;
    Vector first;   ///< Derivative by the parameter.
    Vector second;  ///< Second derivative.
  };

  /// Without control points: only size(), step() and end() may be called.
  UniformSpline() = default;
  /// Control points `step` apart, > 0; at least one.
  UniformSpline(std::vector<Vector> points, double step)
      : points_(std::move(points)), step_(step) {}

  /// Number of control points.
  std::size_t size() const { return points_.size(); }
  /// Parameter between two control points.
  double step() const { return step_; }
  /// Parameter of the last control point.
  double end() const {
    return points_.empty() ? 0.0 : static_cast<double>(points_.size() - 1) * step_;
  }
  /// The control points.
  const std::vector<Vector>& points() const { return points_; }

  /// Point and derivatives, defined for every parameter.
  Value at(double parameter) const {
    const double u = parameter / step_;
    const double knot = std::floor(u);
    const double x = u - knot;
    const auto first = static_cast<std::ptrdiff_t>(knot) - 2;
    const Weights w = weights(x);
    Value value{Vector::Zero(), Vector::Zero(), Vector::Zero()};

    for (int i = 0; i < 6; ++i) {
      const auto k =
          std::clamp<std::ptrdiff_t>(first + i, 0, static_cast<std::ptrdiff_t>(points_.size()) - 1);
      const Vector& p = points_[static_cast<std::size_t>(k)];
      value.position += w.position[i] * p;
      value.first += w.first[i] * p;
      value.second += w.second[i] * p;
    }

    value.first /= step_;
    value.second /= step_ * step_;

    return value;
  }

 private:
  struct Weights {
    double position[6];
    double first[6];
    double second[6];
  };

  /// Base functions of degree `degree` that do not vanish at x in [0, 1), by de Boor's recursion.
  template <int Degree>
  static void base(double x, double (&b)[Degree + 1]) {
    b[0] = 1.0;
    for (int d = 1; d <= Degree; ++d) {
      double carried = 0.0;
      for (int i = 0; i < d; ++i) {
        const double share = b[i] / d;
        b[i] = carried + (i + 1 - x) * share;
        carried = (x + d - 1 - i) * share;
      }
      b[d] = carried;
    }
  }

  static Weights weights(double x) {
    Weights w{};
    base<5>(x, w.position);
    double quartic[5];
    base<4>(x, quartic);
    double cubic[4];
    base<3>(x, cubic);

    // The derivative of a base function is the difference of two of one degree lower.
    for (int i = 0; i < 6; ++i) {
      w.first[i] = (i > 0 ? quartic[i - 1] : 0.0) - (i < 5 ? quartic[i] : 0.0);
      const double here = i < 4 ? cubic[i] : 0.0;
      const double middle = i > 0 && i < 5 ? cubic[i - 1] : 0.0;
      const double before = i > 1 ? cubic[i - 2] : 0.0;
      w.second[i] = before - 2.0 * middle + here;
    }

    return w;
  }

  std::vector<Vector> points_;
  double step_ = 1.0;
};

}  // namespace understory::sim
