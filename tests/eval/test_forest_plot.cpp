// Sweeps made out of clouds, on stems whose places are known; and real plots, where the data are
// there.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "eval/experiments/frontend/forest_plot_score.hpp"
#include "tests/catch.hpp"
#include "tests/data.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

/// Round stems of 0.15 m, 600 points per m^2 as real clouds have, on ground that rises.
eval::experiments::frontend::ForestPlot round_stems(const std::vector<Eigen::Vector2d>& places) {
  eval::experiments::frontend::ForestPlot plot;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  std::normal_distribution<double> bark(0.0, 0.005);

  for (const Eigen::Vector2d& place : places) {
    plot.stems.push_back({place, 0.15});
    for (int i = 0; i < 1600; ++i) {
      const double angle = 2.0 * std::numbers::pi * part(random);
      const double height = 0.2 + 2.8 * part(random);
      const Eigen::Vector2d at =
          place + (0.15 + bark(random)) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      plot.points.push_back({{at.x(), at.y(), 0.05 * at.x() + height}, height});
    }
  }

  return plot;
}

}  // namespace

TEST_CASE("A sweep out of a cloud lies on its near surfaces", "[forest_plot]") {
  const eval::experiments::frontend::ForestPlot plot =
      round_stems({{4.0, 0.0}, {8.0, 0.0}, {0.0, 6.0}, {-5.0, -2.0}});
  const eval::experiments::frontend::PlotScanner scanner(plot, {});
  std::mt19937_64 random(1);
  const eval::experiments::frontend::PlotSweep result = scanner.sweep({0.0, 0.0}, random);

  std::vector<int> returns(plot.stems.size(), 0);
  int behind = 0;
  for (const model::SweepPoint& point : result.sweep.points) {
    const Eigen::Vector2d at = point.position().head<2>().cast<double>();
    for (std::size_t i = 0; i < plot.stems.size(); ++i) {
      const Eigen::Vector2d& stem = plot.stems[i].position_m;
      const double off = (at - stem).norm();
      if (off > 0.25 || point.z_m < 0.5F) continue;
      ++returns[i];
      CHECK(std::abs(off - 0.15) < 0.09);  // noise of 2 cm along the ray
      if (at.dot(stem.normalized()) > stem.norm() + 0.05) ++behind;
    }
  }

  CHECK(behind <= 2);
  CHECK(returns[0] > 100);
  CHECK(returns[1] == 0);  // hidden
  CHECK(returns[2] > 100);
  CHECK(returns[3] > 100);

  CHECK(result.stems[0].returns > 0.9 * result.stems[0].beams);
  CHECK(result.stems[1].beams == 0);
}

TEST_CASE("Round stems of a cloud are found in their place", "[forest_plot]") {
  const eval::experiments::frontend::ForestPlot plot =
      round_stems({{0.0, 0.0}, {6.0, 1.0}, {1.0, 7.0}, {7.0, 8.0}, {3.0, 12.0}, {9.0, 13.0}});
  const eval::experiments::frontend::PlotScore score = score_plot(plot, {}, {});
  CHECK(score.should > 50);
  CHECK(score.recall() > 0.9);
  CHECK(score.precision() > 0.97);
  CHECK(score.all.difference_m < 0.03);
  CHECK(score.whole.difference_m < 0.02);
  CHECK(std::abs(score.whole.radius_bias_m) < 0.006);
  CHECK(score.whole.nees > 0.7);
  CHECK(score.whole.nees < 2.6);
}

TEST_CASE("Stations are where a vehicle has room, low shrubs and high branches or not",
          "[forest_plot]") {
  eval::experiments::frontend::ForestPlot plot;
  plot.stems = {{{0.0, 0.0}, 0.15}, {{6.0, 6.0}, 0.15}};
  plot.points = {{{2.25, 2.25, 0.9}, 0.9}, {{3.75, 3.75, 2.3}, 2.3}};
  CHECK(plot_stations(plot, {}).size() == 16);
  plot.points.push_back({{5.25, 0.75, 1.5}, 1.5});
  const auto stations = plot_stations(plot, {});
  REQUIRE(stations.size() == 15);
  for (const Eigen::Vector2d& station : stations)
    CHECK((station - Eigen::Vector2d(5.25, 0.75)).norm() > 0.6);
}

TEST_CASE("A stem that a cloud shows from one side only is whole from there", "[forest_plot]") {
  eval::experiments::frontend::ForestPlot plot = round_stems({{0.0, 0.0}});
  std::erase_if(plot.points, [](const eval::experiments::frontend::PlotPoint& point) {
    return point.position_m.x() < -0.05;
  });
  const eval::experiments::frontend::PlotScanner scanner(plot, {});
  std::mt19937_64 random(1);
  CHECK(scanner.sweep({5.0, 0.0}, random).stems.front().is_whole);
  CHECK_FALSE(scanner.sweep({0.0, 5.0}, random).stems.front().is_whole);
  CHECK_FALSE(scanner.sweep({-5.0, 0.0}, random).stems.front().is_whole);

  // The other side, where the bearing wraps.
  eval::experiments::frontend::ForestPlot turned = round_stems({{0.0, 0.0}});
  std::erase_if(turned.points, [](const eval::experiments::frontend::PlotPoint& point) {
    return point.position_m.x() > 0.05;
  });
  const eval::experiments::frontend::PlotScanner other(turned, {});
  for (const double y : {-0.1, 0.1}) {
    CHECK(other.sweep({-5.0, y}, random).stems.front().is_whole);
    CHECK_FALSE(other.sweep({5.0, y}, random).stems.front().is_whole);
  }
}

TEST_CASE("Stems of a real plot are found", "[forest_plot][recorded]") {
  const std::filesystem::path plots_folder = test::recording("forest_3d_scans");
  eval::experiments::frontend::PlotScoreOptions options;
  options.grid_m = 3.0;
  options.clearance_m = 0.4;
  for (const char* name : {"TLS_Clip", "pine_plot"}) {
    const eval::experiments::frontend::PlotScore score =
        score_plot(eval::experiments::frontend::read_forest_plot(plots_folder, name), {}, options);
    CHECK(score.should > 20);
    CHECK(score.recall() > 0.5);
    CHECK(score.precision() > 0.7);
  }
}
