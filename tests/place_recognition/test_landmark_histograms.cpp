// Histograms of ranges and of pairs of landmarks, against the papers' formulas written out slowly.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "common/place_recognition/detectors/glare.hpp"
#include "common/place_recognition/detectors/glarot_3d.hpp"
#include "common/place_recognition/detectors/range_histogram.hpp"
#include "tests/catch.hpp"
#include "tests/place_recognition/place_scene.hpp"

using namespace understory;
using namespace understory::place_recognition;
using namespace understory::place_recognition::detectors;

namespace {

constexpr double kPi = std::numbers::pi;
/// Rows are kept as float.
constexpr double kRounded = 1e-6;

std::vector<float> row_of(const auto& signature, const PlaceFrame& frame) {
  std::vector<float> row(signature.length(), 0.0F);
  REQUIRE(signature.describe(frame, row));
  return row;
}

double largest_difference(const std::vector<float>& row, const std::vector<double>& wanted) {
  REQUIRE(row.size() == wanted.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < row.size(); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(row[i]) - wanted[i]));
  return largest;
}

/// Thesis 002 eq. 2.22: for each bin all points are looked at.
std::vector<double> slow_ranges(const PlaceFrame& frame, const RangeHistogramParameters& p) {
  std::vector<double> share(p.bins, 0.0);
  const double width = p.max_range_m / static_cast<double>(p.bins);
  double all = 0.0;
  for (std::size_t bin = 0; bin < p.bins; ++bin) {
    for (const PlaceLandmark& landmark : frame.landmarks) {
      const double range = landmark.position_m.cast<float>().cast<double>().norm();
      const bool is_in =
          range >= static_cast<double>(bin) * width && range < static_cast<double>(bin + 1) * width;
      share[bin] += is_in ? 1.0 : 0.0;
      all += is_in ? 1.0 : 0.0;
    }
  }
  for (double& one : share) one /= all;
  return share;
}

/// The sum over every bin and every pair, in both orders of the pair, halved.
std::vector<double> slow_glare(const PlaceFrame& frame, const GlareParameters& p) {
  std::vector<double> sum(p.range_bins * p.bearing_bins, 0.0);
  double all = 0.0;
  for (std::size_t bin = 0; bin < sum.size(); ++bin) {
    const double theta =
        (static_cast<double>(bin / p.range_bins) + 0.5) * kPi / static_cast<double>(p.bearing_bins);
    const double rho = (static_cast<double>(bin % p.range_bins) + 0.5) * p.range_step_m;
    for (std::size_t i = 0; i < frame.landmarks.size(); ++i) {
      for (std::size_t j = 0; j < frame.landmarks.size(); ++j) {
        if (i == j) continue;
        const Eigen::Vector3d d = frame.landmarks[j].position_m - frame.landmarks[i].position_m;
        const double range = std::sqrt(d.x() * d.x() + d.y() * d.y());
        if (range >= p.range_step_m * static_cast<double>(p.range_bins)) continue;
        // The positive one of the two bearings of the pair.
        const double bearing = std::max(std::atan2(d.y(), d.x()), std::atan2(-d.y(), -d.x()));
        const double off_theta =
            std::min({std::abs(theta - bearing), std::abs(theta - bearing + kPi),
                      std::abs(theta - bearing - kPi)});
        const double t = off_theta / p.sigma_bearing_rad;
        const double r = (rho - range) / p.sigma_range_m;
        if (t <= 3.0 && std::abs(r) <= 3.0) sum[bin] += 0.5 * std::exp(-0.5 * (t * t + r * r));
      }
    }
    all += sum[bin];
  }
  for (double& one : sum) one /= all;
  return sum;
}

/// Thesis 002 eq. 2.25, bin by bin.
std::pair<double, std::size_t> slow_shifted(const std::vector<double>& query,
                                            const std::vector<double>& frame, std::size_t thetas) {
  const std::size_t rhos = query.size() / thetas;
  std::pair<double, std::size_t> best{1e9, 0};
  for (std::size_t beta = 0; beta < thetas; ++beta) {
    double sum = 0.0;
    for (std::size_t t = 0; t < thetas; ++t) {
      for (std::size_t r = 0; r < rhos; ++r)
        sum += std::abs(query[t * rhos + r] - frame[(t + beta) % thetas * rhos + r]);
    }
    best = std::min(best, {sum, beta});
  }
  return best;
}

std::vector<float> as_float(const std::vector<double>& values) {
  return {values.begin(), values.end()};
}

/// A map from (face, u, v, range) to shares, by the definition: the face whose normal is nearest.
using SlowCells = std::map<std::tuple<int, int, int, int>, double>;
SlowCells slow_glarot_3d(const PlaceFrame& frame, const Glarot3dParameters& p,
                         const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const std::vector<Eigen::Vector3d> normal{x, -x, y, -y, z, -z};
  const std::vector<Eigen::Vector3d> u_axis{y, y, z, z, x, x};
  const std::vector<Eigen::Vector3d> v_axis{z, z, x, x, y, y};
  SlowCells cells;
  double pairs = 0.0;
  for (const PlaceLandmark& from : frame.landmarks) {
    for (const PlaceLandmark& to : frame.landmarks) {
      if (&from == &to) continue;
      const Eigen::Vector3d r = rotation * (to.position_m - from.position_m);
      const int range = static_cast<int>(std::floor(r.norm() / p.range_step_m));
      if (range >= static_cast<int>(p.range_bins)) continue;
      int face = 0;
      for (int f = 1; f < 6; ++f) {
        if (normal[static_cast<std::size_t>(f)].dot(r) >
            normal[static_cast<std::size_t>(face)].dot(r))
          face = f;
      }
      const auto f = static_cast<std::size_t>(face);
      const auto index = [&](const Eigen::Vector3d& axis) {
        const double place = static_cast<double>(p.grid) *
                             (2.0 / kPi * std::atan2(axis.dot(r), normal[f].dot(r)) + 0.5);
        return std::min(static_cast<int>(p.grid) - 1, static_cast<int>(std::floor(place)));
      };
      cells[{face, index(u_axis[f]), index(v_axis[f]), range}] += 1.0;
      pairs += 1.0;
    }
  }
  for (auto& cell : cells) cell.second /= pairs;
  return cells;
}

double slow_l1(const SlowCells& a, const SlowCells& b) {
  double sum = 0.0;
  for (const auto& [cell, share] : a)
    sum += std::abs(share - (b.contains(cell) ? b.at(cell) : 0.0));
  for (const auto& [cell, share] : b) sum += a.contains(cell) ? 0.0 : share;
  return sum;
}

}  // namespace

TEST_CASE("The histogram of ranges is that of the formula", "[histograms]") {
  std::mt19937_64 random(1);
  RangeHistogramParameters parameters;
  parameters.bins = 37;
  const RangeHistogram histogram(parameters);
  for (int trial = 0; trial < 20; ++trial) {
    const PlaceFrame a = test::random_frame(random, 5 + static_cast<std::size_t>(trial), 45.0);
    const PlaceFrame b = test::random_frame(random, 30, 45.0);
    const auto slow_a = slow_ranges(a, parameters);
    const auto slow_b = slow_ranges(b, parameters);
    CHECK(largest_difference(row_of(histogram, a), slow_a) < kRounded);

    double wasserstein = 0.0;
    for (std::size_t i = 0; i < slow_a.size(); ++i) {
      double inner = 0.0;
      for (std::size_t j = 0; j <= i; ++j) inner += slow_a[j] - slow_b[j];
      wasserstein += std::abs(inner) / static_cast<double>(parameters.bins);
    }
    const double found = histogram.compare(row_of(histogram, a), row_of(histogram, b)).distance;
    CHECK(std::abs(found - wasserstein) < kRounded);
  }
}

TEST_CASE("GLARE is the sum of Gaussians of all pairs", "[histograms]") {
  std::mt19937_64 random(2);
  GlareParameters parameters;
  parameters.range_bins = 50;
  parameters.bearing_bins = GENERATE(std::size_t{7}, std::size_t{16});
  const GlareSignature glare(parameters, BearingInvariance::kNone, 2.0);
  const GlareSignature glarot(parameters, BearingInvariance::kShifted, 2.0);
  for (int trial = 0; trial < 8; ++trial) {
    const PlaceFrame a = test::random_frame(random, 12);
    const PlaceFrame b = test::random_frame(random, 9);
    const auto slow_a = slow_glare(a, parameters);
    const auto slow_b = slow_glare(b, parameters);
    CHECK(largest_difference(row_of(glare, a), slow_a) < kRounded);

    double l1 = 0.0;
    for (std::size_t i = 0; i < slow_a.size(); ++i) l1 += std::abs(slow_a[i] - slow_b[i]);
    CHECK(std::abs(glare.compare(as_float(slow_a), as_float(slow_b)).distance - l1) < 1e-5);
    const auto [shifted, beta] = slow_shifted(slow_a, slow_b, parameters.bearing_bins);
    const RowDistance found = glarot.compare(as_float(slow_a), as_float(slow_b));
    CHECK(std::abs(found.distance - shifted) < 1e-5);
    CHECK(found.shift == beta);
  }
}

TEST_CASE("GLAROT does not change when the frame turns by whole bins, GLARE does", "[histograms]") {
  std::mt19937_64 random(3);
  const GlareParameters parameters;
  const GlareSignature glare(parameters, BearingInvariance::kNone, 2.0);
  const GlareSignature glarot(parameters, BearingInvariance::kShifted, 2.0);
  const double step = kPi / static_cast<double>(parameters.bearing_bins);
  for (int turn = 1; turn < 2 * static_cast<int>(parameters.bearing_bins); turn += 3) {
    const PlaceFrame frame = test::random_frame(random, 20);
    // Wherever it was taken: distances and directions between landmarks alone count.
    const geometry::SE2 frame_T_query(3.0, -2.0, step * turn);
    const auto query = row_of(glarot, test::seen_from(frame, frame_T_query));
    const RowDistance found = glarot.compare(query, row_of(glarot, frame));
    CHECK(found.distance < 1e-4);
    const auto guesses = glarot.guesses(found.shift);
    REQUIRE(guesses.size() == 2);
    const double off =
        std::min(std::abs(geometry::wrap_angle(guesses[0].mean.theta() - frame_T_query.theta())),
                 std::abs(geometry::wrap_angle(guesses[1].mean.theta() - frame_T_query.theta())));
    CHECK(off < 1e-9);
    if (turn % static_cast<int>(parameters.bearing_bins) != 0)
      CHECK(glare.compare(query, row_of(glare, frame)).distance > 0.2);
  }
}

TEST_CASE("GLAROT-3D is the histogram over the cube, rotated", "[histograms]") {
  std::mt19937_64 random(4);
  Glarot3dParameters parameters;
  parameters.grid = GENERATE(std::size_t{1}, std::size_t{3}, std::size_t{4});
  const Glarot3dSignature signature(parameters, 2.0);
  REQUIRE(Glarot3dSignature::rotations().size() == 24);
  for (int trial = 0; trial < 6; ++trial) {
    PlaceFrame a = test::random_frame(random, 12, 8.0);
    PlaceFrame b = test::random_frame(random, 14, 8.0);
    for (PlaceLandmark& landmark : b.landmarks) landmark.position_m.z() *= 5.0;
    for (PlaceLandmark& landmark : a.landmarks) landmark.position_m.z() *= 5.0;

    // Rotating the landmarks instead of the histogram.
    double least = 1e9;
    for (const Eigen::Matrix3d& rotation : Glarot3dSignature::rotations()) {
      least = std::min(least, slow_l1(slow_glarot_3d(a, parameters, rotation),
                                      slow_glarot_3d(b, parameters, Eigen::Matrix3d::Identity())));
    }
    const double found = signature.compare(row_of(signature, a), row_of(signature, b)).distance;
    CHECK(std::abs(found - least) < 1e-5);
  }
}

TEST_CASE("GLAROT-3D finds which right angle a frame was turned by", "[histograms]") {
  std::mt19937_64 random(5);
  const Glarot3dSignature signature(Glarot3dParameters{}, 2.0);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const PlaceFrame frame = test::random_frame(random, 25);
    const geometry::SE2 frame_T_query(1.0, 4.0, 0.5 * kPi * quarter);
    const RowDistance found = signature.compare(
        row_of(signature, test::seen_from(frame, frame_T_query)), row_of(signature, frame));
    CHECK(found.distance < 0.02);
    const auto guesses = signature.guesses(found.shift);
    REQUIRE(guesses.size() == 1);
    CHECK(std::abs(geometry::wrap_angle(guesses[0].mean.theta() - frame_T_query.theta())) < 1e-9);
  }
}
