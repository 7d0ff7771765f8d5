// Scan Context against its definition written out slowly, and its invariances.
#include "common/place_recognition/detectors/scan_context.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/catch.hpp"
#include "tests/place_recognition/place_scene.hpp"

using namespace understory;
using namespace understory::place_recognition;
using namespace understory::place_recognition::detectors;

namespace {

/// Heights by [ring][sector], as the paper's figure draws them.
using SlowContext = std::vector<std::vector<double>>;

SlowContext slow_context(const std::vector<Eigen::Vector3f>& points, const ScanContextParameters& p,
                         double left_m = 0.0) {
  SlowContext context(p.rings, std::vector<double>(p.sectors, 0.0));
  const double ring_m = p.max_range_m / static_cast<double>(p.rings);
  const double sector_rad = 2.0 * std::numbers::pi / static_cast<double>(p.sectors);
  for (std::size_t i = 0; i < p.rings; ++i) {
    for (std::size_t j = 0; j < p.sectors; ++j) {
      for (const Eigen::Vector3f& point : points) {
        const double x = static_cast<double>(point.x());
        const double y = static_cast<double>(point.y()) - left_m;
        const double range = std::sqrt(x * x + y * y);
        double angle = std::atan2(y, x);
        if (angle < 0.0) angle += 2.0 * std::numbers::pi;
        const bool is_in = range >= static_cast<double>(i) * ring_m &&
                           range < static_cast<double>(i + 1) * ring_m &&
                           angle >= static_cast<double>(j) * sector_rad &&
                           angle < static_cast<double>(j + 1) * sector_rad;
        if (is_in)
          context[i][j] = std::max(context[i][j], static_cast<double>(point.z()) + p.lift_m);
      }
    }
  }
  return context;
}

/// Eqs. 2.31 and 2.32 of thesis 002.
std::pair<double, std::size_t> slow_distance(const SlowContext& query, const SlowContext& frame) {
  const std::size_t sectors = query.front().size();
  std::pair<double, std::size_t> best{1e9, 0};
  for (std::size_t n = 0; n < sectors; ++n) {
    double sum = 0.0;
    double counted = 0.0;
    for (std::size_t j = 0; j < sectors; ++j) {
      double dot = 0.0, squared_q = 0.0, squared_c = 0.0;
      for (std::size_t i = 0; i < query.size(); ++i) {
        const double q = query[i][j];
        const double c = frame[i][(j + n) % sectors];
        dot += q * c;
        squared_q += q * q;
        squared_c += c * c;
      }
      if (squared_q == 0.0 && squared_c == 0.0) continue;
      counted += 1.0;
      sum +=
          squared_q == 0.0 || squared_c == 0.0 ? 1.0 : 1.0 - dot / std::sqrt(squared_q * squared_c);
    }
    best = std::min(best, {sum / counted, n});
  }
  return best;
}

}  // namespace

TEST_CASE("Scan Context, its key and its distance are those of the paper", "[scan-context]") {
  std::mt19937_64 random(1);
  ScanContextParameters parameters;
  parameters.rings = 9;
  parameters.sectors = 24;
  const ScanContextMaker maker(parameters);
  for (int trial = 0; trial < 10; ++trial) {
    const auto a = points_of(test::random_frame(random, 60));
    const auto b = points_of(test::random_frame(random, 60));
    const double left_m = trial % 3 - 1.0;
    const auto context_a = maker.describe(a, {0.0, left_m});
    const auto context_b = maker.describe(b, {0.0, 0.0});
    REQUIRE((context_a && context_b));
    const SlowContext slow_a = slow_context(a, parameters, left_m);
    const SlowContext slow_b = slow_context(b, parameters);

    for (std::size_t i = 0; i < parameters.rings; ++i) {
      const auto occupied =
          std::count_if(slow_a[i].begin(), slow_a[i].end(), [](double x) { return x > 0.0; });
      CHECK(std::abs(static_cast<double>(context_a->ring_key[i]) -
                     static_cast<double>(occupied) / 24.0) < 1e-6);
    }
    const auto [distance, shift] = slow_distance(slow_a, slow_b);
    const ContextDistance found = maker.distance(*context_a, *context_b);
    CHECK(std::abs(found.distance - distance) < 1e-5);
    CHECK(found.shift == shift);
  }
}

TEST_CASE("A context that is kept packed has the same sectors and distances", "[scan-context]") {
  std::mt19937_64 random(4);
  const ScanContextParameters parameters;
  const ScanContextMaker maker(parameters);
  for (int trial = 0; trial < 10; ++trial) {
    const auto query = maker.describe(points_of(test::random_frame(random, 300)), {0.0, 0.0});
    auto cloud = points_of(test::random_frame(random, 300));
    // The lowest bin beside the highest one, in one sector.
    cloud.emplace_back(1.0F, 0.01F, -static_cast<float>(parameters.lift_m) + 0.001F);
    cloud.emplace_back(30.0F, 0.01F, 60.0F);
    const auto context = maker.describe(cloud, {0.0, 0.0});
    REQUIRE((query && context));

    const ScanContext back = unpacked(packed(*context));
    CHECK(back.ring_key == context->ring_key);
    for (std::size_t i = 0; i < back.columns.size(); ++i) {
      CHECK((back.columns[i] > 0.0F) == (context->columns[i] > 0.0F));
      CHECK(std::abs(back.columns[i] - context->columns[i]) < 4e-3F);
    }
    CHECK(std::abs(maker.distance(*query, back).distance -
                   maker.distance(*query, *context).distance) < 3e-3);
  }
}

TEST_CASE("A turn by whole sectors shifts the context, and is told", "[scan-context]") {
  std::mt19937_64 random(2);
  const ScanContextParameters parameters;
  const ScanContextMaker maker(parameters);
  for (int turn = 0; turn < 60; turn += 7) {
    PlaceFrame frame;
    // In the middle of sectors and rings, so that rounding moves no point.
    for (int k = 0; k < 40; ++k) {
      const double angle = (static_cast<double>(random() % 60) + 0.5) * std::numbers::pi / 30.0;
      const double range = 2.0 * static_cast<double>(random() % 20) + 1.0;
      frame.cloud.emplace_back(
          Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), k % 5).cast<float>());
    }

    const geometry::SE2 frame_T_query(0.0, 0.0, turn * std::numbers::pi / 30.0);
    const auto query = maker.describe(test::seen_from(frame, frame_T_query).cloud, {0.0, 0.0});
    const auto context = maker.describe(frame.cloud, {0.0, 0.0});
    REQUIRE((query && context));

    CHECK(maker.key_distance(query->ring_key, context->ring_key) < 1e-6);
    const ContextDistance found = maker.distance(*query, *context);
    CHECK(found.distance < 1e-5);
    CHECK(std::abs(geometry::wrap_angle(maker.heading_rad(found.shift) - frame_T_query.theta())) <
          1e-9);
  }
}

TEST_CASE("Root shifts find a frame that was taken beside the query", "[scan-context]") {
  std::mt19937_64 random(3);
  ScanContextParameters parameters;
  parameters.root_shift_m = 2.0;
  parameters.root_shifts = 1;
  const ScanContextMaker maker(parameters);
  for (int trial = 0; trial < 10; ++trial) {
    PlaceFrame frame = test::random_frame(random, 30);
    frame.cloud = test::random_cloud(frame, 0.0, random);
    // The query lies 2 m to the right of the frame, as turned.
    const geometry::SE2 frame_T_query =
        geometry::SE2(0.0, 0.0, std::numbers::pi / 3.0) * geometry::SE2(0.0, -2.0, 0.0);
    const auto contexts = shifted_contexts(maker, test::seen_from(frame, frame_T_query));
    const BestContext best =
        best_context(maker, contexts, *maker.describe(frame.cloud, {0.0, 0.0}));
    CHECK((best.frame_T_query.inverse() * frame_T_query).Log().norm() < 0.01);
    CHECK(best.distance < 0.02);
  }
}
