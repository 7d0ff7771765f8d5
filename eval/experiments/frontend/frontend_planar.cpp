// Landmarks of a laser with one plane, with and without de-skewing.
#include <fmt/format.h>

#include <numbers>
#include <string>
#include <vector>

#include "eval/experiments/frontend/frontend.hpp"
#include "eval/experiments/frontend/planar_extraction.hpp"
#include "eval/tools/parallel.hpp"

namespace understory::eval::experiments::frontend {
namespace {

void add_kind_rows(const std::string& what, const KindScore& score, bool is_deskewed,
                   FrontendRows& rows) {
  if (is_deskewed) {
    rows.at_least(what + ": precision", score.precision(), "", 0.95);
    rows.between(what + ": NEES in the plan (2)", score.nees_plan, "", 1.5, 2.5);
  } else {
    rows.state(what + ": precision", score.precision(), "");
    rows.state(what + ": NEES in the plan (2)", score.nees_plan, "");
  }
  rows.state(what + ": recall", score.recall(), "");
  rows.state(what + ": error in the plan, RMS to 20 m", 100.0 * score.rms_m, "cm");
  rows.state(what + ": mean error along the ray", 1e3 * score.bias_along_m, "mm");
  rows.state(what + ": mean error across it", 1e3 * score.bias_across_m, "mm");
}

}  // namespace

void add_planar_rows(const FrontendOptions& options, const std::atomic<bool>& stop,
                     FrontendRows& rows) {
  struct Setting {
    const char* name;
    bool has_beam_times;
    double revolution_s;
  };
  const std::vector<Setting> settings{{"taken as they are", false, 0.1},
                                      {"de-skewed", true, 0.1},
                                      {"all beams at once", false, 0.0}};
  std::vector<PlanarScore> scores(settings.size());
  tools::run_in_parallel(settings.size(), options.jobs, "one plane", stop, [&](std::size_t i) {
    PlanarDriveOptions drive;
    drive.has_beam_times = settings[i].has_beam_times;
    drive.revolution_s = settings[i].revolution_s;
    drive.seed = options.seed;
    drive.scans = 30 * options.runs;
    scores[i] = score_planar_drive(drive);
  });

  for (std::size_t i = 0; i < settings.size(); ++i) {
    const PlanarScore& score = scores[i];
    rows.in(
        fmt::format("laser with one plane, 5 m/s on a circle of 30 degrees/s, scans over {:.0f} "
                    "ms: {} ({} scans)",
                    500.0 * settings[i].revolution_s, settings[i].name, score.scans));
    const bool is_deskewed = settings[i].has_beam_times;
    add_kind_rows("trunks", score.trunks, is_deskewed, rows);
    add_kind_rows("corners", score.corners, is_deskewed, rows);
    rows.state("corners: bisector, RMS", 180.0 / std::numbers::pi * score.corners.bearing_rms_rad,
               "deg");
    rows.state("corners: NEES of the bisector (1)", score.corners.nees_bearing, "");
  }
}

}  // namespace understory::eval::experiments::frontend
