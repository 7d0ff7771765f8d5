// Landmarks of a laser with one plane on a vehicle that drives and turns.
#include "eval/experiments/frontend/planar_extraction.hpp"

#include "tests/catch.hpp"

using namespace understory::eval::experiments::frontend;

TEST_CASE("Trunks and corners of one plane are where they are at 5 m/s and 30 degrees/s",
          "[frontend]") {
  PlanarDriveOptions options;
  options.scans = 300;
  const PlanarScore deskewed = score_planar_drive(options);
  options.has_beam_times = false;
  const PlanarScore skewed = score_planar_drive(options);
  REQUIRE(deskewed.scans == 300);
  REQUIRE(skewed.scans == 300);

  for (const KindScore* kind : {&deskewed.trunks, &deskewed.corners}) {
    INFO(kind->right << " right of " << kind->detections << ", recall " << kind->recall()
                     << ", RMS " << kind->rms_m << " m, NEES " << kind->nees_plan);
    CHECK(kind->right > 100);
    CHECK(kind->precision() > 0.95);
    CHECK(kind->nees_plan > 1.3);
    CHECK(kind->nees_plan < 2.7);
    CHECK(std::abs(kind->bias_along_m) < 0.02);
    CHECK(std::abs(kind->bias_across_m) < 0.02);
  }
  CHECK(skewed.trunks.rms_m > 4.0 * deskewed.trunks.rms_m);
  CHECK(skewed.trunks.nees_plan > 20.0);
  CHECK(skewed.corners.rms_m > 4.0 * deskewed.corners.rms_m);
}

TEST_CASE("Scans of one plane without any motion go out as they are, and say so", "[frontend]") {
  PlanarDriveOptions options;
  options.has_motion_sensors = false;
  options.scans = 30;
  const PlanarScore score = score_planar_drive(options);
  CHECK(score.scans == 30);
  CHECK(score.not_deskewed > 30);
}
