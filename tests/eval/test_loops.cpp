// Drives of stem frames with what is true of them.
#include <algorithm>
#include <map>
#include <random>

#include "eval/experiments/loops/loop_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments;

TEST_CASE("Detections of one tree are known as such, however noisy they are", "[loops]") {
  // Sixty stems 2.5 m apart beside a straight way, each seen from every frame.
  for (const double sigma_m : {0.01, 0.05, 0.1, 0.15}) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise(0.0, sigma_m);
    std::vector<model::StemFrame> frames;
    for (int k = 0; k < 40; ++k) {
      model::StemFrame& frame = frames.emplace_back();
      frame.utime = 1'000'000 * (k + 1);
      frame.number = k;
      frame.world_T_sensor.translation() << 0.5 * k, 0.0, 0.0;
      for (int stem = 0; stem < 60; ++stem) {
        const int row = stem / 2;
        const double x = 2.5 * row + noise(random) - 0.5 * k;
        const double y = (stem % 2 == 0 ? 4.0 : -4.0) + noise(random);
        frame.stems.push_back({.position_m = Eigen::Vector3d(x, y, 0.0)});
      }
    }
    const loops::LoopDrive drive = loops::loop_drive("row", frames, {}, 1);

    // Of each stem, detections that went to its most frequent tree.
    std::size_t right = 0, all = 0;
    for (std::size_t stem = 0; stem < 60; ++stem) {
      std::map<int, std::size_t> counts;
      for (const auto& of_frame : drive.trees) ++counts[of_frame[stem]];
      const auto most =
          std::ranges::max_element(counts, {}, [](const auto& one) { return one.second; });
      right += most->second;
      all += drive.trees.size();
    }
    CAPTURE(sigma_m, right, all, drive.tree_count);
    CHECK(right > 0.99 * static_cast<double>(all));
  }
}
