// Motions between frozen nodes: fused, taken apart, and kept in little room.
#include <random>

#include "common/geometry/decompositions.hpp"
#include "common/state/archive.hpp"
#include "services/geoslam_mapper/smoothing/frozen_motions.hpp"
#include "services/geoslam_mapper/smoothing/fused_motion.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::geoslam_mapper::smoothing;

namespace {

/// What landmarks up to 40 m away tell of a motion; of one landmark alone a direction is open.
MeasuredMotion random_motion(const geometry::SE2& about, int landmarks, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  MeasuredMotion result;
  result.a_T_b = about * geometry::SE2::Exp(
                             {0.02 * normal(random), 0.02 * normal(random), 5e-4 * normal(random)});
  for (int i = 0; i < landmarks; ++i) {
    Eigen::Matrix<double, 2, 3> j;
    j << 1.0, 0.0, 20.0 * normal(random), 0.0, 1.0, 20.0 * normal(random);
    result.information += 400.0 * j.transpose() * j;
  }
  return result;
}

double cost(const MeasuredMotion& one, const geometry::SE2& at) {
  const Eigen::Vector3d off = (at.inverse() * one.a_T_b).Log();
  return off.dot(one.information * off);
}

/// How far they are apart where both are measured [m, rad].
double apart(const MeasuredMotion& a, const MeasuredMotion& b) {
  const Eigen::Vector3d off = (a.a_T_b.inverse() * b.a_T_b).Log();
  return std::sqrt(off.dot(a.information * off) / a.information.trace());
}

}  // namespace

TEST_CASE("Fused motions are where their errors are least", "[frozen_motions]") {
  std::mt19937_64 random(71);
  for (int round = 0; round < 200; ++round) {
    const geometry::SE2 about(20.0, -3.0, 0.3);
    const MeasuredMotion a = random_motion(about, 1 + round % 4, random);
    const MeasuredMotion b = random_motion(about, 1 + round % 3, random);
    const MeasuredMotion sum = fused(a, b);
    CHECK(sum.information.isApprox(a.information + b.information));
    const double least = cost(a, sum.a_T_b) + cost(b, sum.a_T_b);
    for (int k = 0; k < 3; ++k) {
      for (const double step : {-1e-3, 1e-3}) {
        const geometry::SE2 beside =
            sum.a_T_b * geometry::SE2::Exp(step * Eigen::Vector3d::Unit(k));
        CHECK(cost(a, beside) + cost(b, beside) > least - 1e-6);
      }
    }
  }
}

TEST_CASE("A part of a fused motion is taken out again, in any order", "[frozen_motions]") {
  std::mt19937_64 random(72);
  for (int round = 0; round < 200; ++round) {
    const geometry::SE2 about(15.0, 8.0, -2.9);
    const MeasuredMotion a = random_motion(about, 1 + round % 4, random);
    const MeasuredMotion b = random_motion(about, 1 + round % 3, random);
    const MeasuredMotion c = random_motion(about, 2, random);
    const MeasuredMotion left = without(without(fused(fused(a, b), c), b), c);
    CHECK((left.information - a.information).norm() <
          1e-9 * (a.information + b.information).norm());
    CHECK(geometry::eigenvalues(left.information)[0] > -1e-9);
    CHECK(apart(a, left) < 5e-5);  // They differ by 2 cm: terms of second order.
    const MeasuredMotion nothing = without(fused(a, b), fused(a, b));
    CHECK(nothing.information.isZero(0.0));
  }
}

TEST_CASE("Frozen motions keep micrometres and the information", "[frozen_motions]") {
  std::mt19937_64 random(73);
  FrozenMotions motions;
  std::vector<FrozenMotion> given;
  for (std::uint32_t i = 0; i < 300; ++i) {
    const MeasuredMotion one =
        random_motion({40.0, -30.0, 3.1}, 1 + static_cast<int>(i % 4), random);
    const NodeIndex b = i == 250 ? i + 70'000 : (i == 260 ? 10 : i + 1);  // Far on, and back.
    const std::uint32_t away = i == 270 ? 100'000 : i % 3;
    given.push_back({i, b, one.a_T_b, one.information, away, i % 7 == 0 ? i + 1 : 0});
    motions.add(given.back());
  }
  constexpr state::Format kFormat{"test", 1};
  FrozenMotions loaded;
  state::load(state::save(kFormat, motions), kFormat, loaded);
  CHECK(loaded.size() == given.size());
  CHECK(loaded.has_closure(8));
  CHECK_FALSE(loaded.has_closure(9));
  const std::vector<FrozenMotion> all = loaded.all();
  REQUIRE(all.size() == given.size());
  for (const FrozenMotion& one : all) {
    const FrozenMotion& was = given[one.a];
    CHECK(one.b == was.b);
    CHECK(one.closure == was.closure);
    if (was.closure == 0) CHECK(one.away == was.away);
    CHECK((was.a_T_b.inverse() * one.a_T_b).Log().norm() < 1e-5);
    CHECK((one.information - was.information).norm() < 1e-6 * was.information.norm());
    CHECK(geometry::eigenvalues(one.information)[0] > -1e-9 * was.information.norm());
  }

  // What has no end among the frozen ones goes.
  NodeSet frozen;
  for (NodeIndex node = 100; node < 200; ++node) frozen.insert(node);
  const std::vector<FrozenMotion> taken = loaded.take_beyond(frozen);
  CHECK(taken.size() + loaded.size() == given.size());
  CHECK(loaded.size() == 101);
  for (const FrozenMotion& one : taken) CHECK((one.b < 100 || one.a >= 200));
}
