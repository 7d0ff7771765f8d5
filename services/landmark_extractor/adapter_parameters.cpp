#include "services/landmark_extractor/adapter_parameters.hpp"

#include "common/model/place_scan.hpp"

namespace understory::landmark_extractor {
namespace {

void describe_sensor(PlanarTrunkParameters& p, bus::ParameterTable& table) {
  table.add("planar.min_range_m", p.min_range_m, {0.0, 100.0}, "m",
            "Nearer returns are from the vehicle itself.");
  table.add("planar.max_range_m", p.max_range_m, {1.0, 1000.0}, "m",
            "Trunks farther than this are not reported.");
  table.add("planar.range_sigma_m", p.range_sigma_m, {1e-4, 10.0}, "m", "Noise of one beam.");
  table.add("planar.beam_width_rad", p.beam_width_rad, {0.0, 0.1}, "rad",
            "Widening of a trunk by a beam's footprint, on each side.");
}

void describe_shape(PlanarTrunkParameters& p, bus::ParameterTable& table) {
  table.add("planar.roundness_sigma_m", p.roundness_sigma_m, {0.0, 1.0}, "m",
            "Deviation of the bark from a circle, sigma.");
  table.add("planar.shape_sigma_m", p.shape_sigma_m, {0.0, 1.0}, "m",
            "Error of the centre as seen from one side, sigma.");
  table.add("planar.shape_correlation_scans", p.shape_correlation_scans, {1.0, 1000.0}, "scans",
            "Number of scans over which that error is correlated.");
  table.add("planar.min_radius_m", p.min_radius_m, {0.001, 10.0}, "m", "Least radius of a trunk.");
  table.add("planar.max_radius_m", p.max_radius_m, {0.01, 10.0}, "m", "Largest radius of a trunk.");
  table.add("planar.prior_radius_m", p.prior_radius_m, {0.001, 10.0}, "m",
            "A trunk's radius before it is measured.");
  table.add("planar.prior_radius_sigma_m", p.prior_radius_sigma_m, {0.001, 10.0}, "m",
            "Sigma of the prior.");
}

void describe_selection(PlanarTrunkParameters& p, bus::ParameterTable& table) {
  table.add("planar.break_distance_m", p.break_distance_m, {0.01, 10.0}, "m",
            "Neighbouring returns farther apart are two objects.");
  table.add("planar.break_per_range", p.break_per_range, {0.0, 1.0}, "m per m",
            "Added to that for each metre of range.");
  table.add("planar.clearance_m", p.clearance_m, {0.0, 100.0}, "m",
            "Returns beside a trunk must be farther away by this.");
  table.add("planar.separation_m", p.separation_m, {0.0, 100.0}, "m",
            "Least distance of a trunk to any other object; bushes have less.");
  table.add("planar.line_tolerance_m", p.line_tolerance_m, {0.0, 10.0}, "m",
            "Objects this near to the line between their neighbours are walls.");
  table.add("planar.min_points", p.min_points, {1, 1000}, "", "Fewest beams on a trunk.");
  table.add("planar.max_mean_square_residual", p.max_mean_square_residual, {0.1, 1e6}, "sigma^2",
            "Mean square residual of the ranges.");
}

void describe_sweep(SweepParameters& p, bus::ParameterTable& table) {
  table.add("sweep.min_range_m", p.min_range_m, {0.0, 100.0}, "m",
            "Nearer returns are from the vehicle itself.");
  table.add("sweep.max_range_m", p.max_range_m, {1.0, 100.0}, "m",
            "Landmarks farther than this are not reported.");
  table.add("sweep.range_sigma_m", p.range_sigma_m, {1e-4, 1.0}, "m", "Noise of one beam.");
  table.add("sweep.beam_width_rad", p.beam_width_rad, {0.0, 0.1}, "rad",
            "Widening of an object by a beam's footprint, on each side.");
  table.add("sweep.min_height_m", p.min_height_m, {0.05, 10.0}, "m",
            "Least height above ground; lower returns are ground, grass, stones.");
  table.add("sweep.max_height_m", p.max_height_m, {1.0, 100.0}, "m",
            "Largest height above ground; higher returns are canopy.");
  table.add("sweep.break_distance_m", p.break_distance_m, {0.01, 10.0}, "m",
            "Neighbouring returns farther apart are two objects.");
  table.add("sweep.break_per_range", p.break_per_range, {0.0, 1.0}, "m per m",
            "Added to that for each metre of range.");
  table.add("sweep.clearance_m", p.clearance_m, {0.0, 100.0}, "m",
            "Returns beside an object's edge must be farther away by this.");
  table.add("sweep.standing_height_m", p.standing_height_m, {0.5, 20.0}, "m",
            "Objects that end below this height are persons, bushes, cars, stumps.");
  table.add("sweep.breast_height_m", p.breast_height_m, {0.0, 5.0}, "m",
            "Height above ground of a landmark's position.");
  table.add("sweep.level_sigma_rad", p.level_sigma_rad, {1e-5, 1.0}, "rad",
            "Sigma of roll and of pitch where the sweep has no attitude.");
}

void describe_trunk_shape(SweepTrunkParameters& p, bus::ParameterTable& table) {
  table.add("trunk.min_radius_m", p.min_radius_m, {0.001, 10.0}, "m", "Least radius of a trunk.");
  table.add("trunk.max_radius_m", p.max_radius_m, {0.01, 10.0}, "m", "Largest radius of a trunk.");
  table.add("trunk.prior_radius_m", p.prior_radius_m, {0.001, 10.0}, "m",
            "A trunk's radius before it is measured.");
  table.add("trunk.prior_radius_sigma_m", p.prior_radius_sigma_m, {0.001, 10.0}, "m",
            "Sigma of the prior.");
  table.add("trunk.prior_lean_sigma_rad", p.prior_lean_sigma_rad, {1e-4, 1.0}, "rad",
            "Sigma of the lean of a trunk's axis.");
  table.add("trunk.prior_taper", p.prior_taper, {-0.2, 0.2}, "m per m",
            "Change of radius per metre of height.");
  table.add("trunk.prior_taper_sigma", p.prior_taper_sigma, {1e-4, 0.2}, "m per m",
            "Sigma of the prior.");
  table.add("trunk.roundness_sigma_m", p.roundness_sigma_m, {0.0, 1.0}, "m",
            "Deviation of the bark from a circle, sigma.");
  table.add(
      "trunk.out_of_round", p.out_of_round, {0.0, 1.0}, "m per m",
      "RMS deviation of a stem's outline from a circle (low harmonics), as a share of its radius.");
  table.add("trunk.max_lean_rad", p.max_lean_rad, {0.01, 1.5}, "rad",
            "Objects that lean more are branches.");
}

void describe_trunk_selection(SweepTrunkParameters& p, bus::ParameterTable& table) {
  table.add("trunk.max_sigma_m", p.max_sigma_m, {0.001, 10.0}, "m",
            "Trunks with a larger sigma of the centre are left out.");
  table.add("trunk.max_mean_square_residual", p.max_mean_square_residual, {0.1, 1e6}, "sigma^2",
            "Mean square residual of ranges and edges.");
  table.add("trunk.gather_radius_m", p.gather_radius_m, {0.01, 10.0}, "m",
            "Largest horizontal distance of the parts of one trunk.");
  table.add("trunk.leaf_radius_m", p.leaf_radius_m, {0.01, 10.0}, "m",
            "Returns this near to a trunk are counted for trunk.min_share.");
  table.add("trunk.min_share", p.min_share, {0.0, 1.0}, "",
            "Part of the returns within trunk.leaf_radius_m that must be on the bark.");
  table.add("trunk.min_points", p.min_points, {1, 1000}, "", "Fewest returns on a trunk.");
  table.add("trunk.min_rings", p.min_rings, {1, 100}, "", "Fewest rings that measure it.");
}

/// Wall parameters that also apply to one-plane lasers.
void describe_walls(CornerParameters& p, const std::string& name, bus::ParameterTable& table) {
  table.add(name + ".line_tolerance_m", p.line_tolerance_m, {0.001, 1.0}, "m",
            "Returns this near to a line are on it.");
  table.add(name + ".min_length_m", p.min_length_m, {0.05, 100.0}, "m",
            "Least measured length of a wall.");
  table.add(name + ".max_gap_m", p.max_gap_m, {0.0, 10.0}, "m",
            "Largest distance from the end of a wall's returns to the corner.");
  table.add(name + ".max_gap_per_range", p.max_gap_per_range, {0.0, 1.0}, "m per m",
            "Added to that for each metre of range.");
  table.add(name + ".max_skew_rad", p.max_skew_rad, {0.0, 1.5}, "rad",
            "Largest deviation of the angle between the walls from 90 degrees.");
  table.add(name + ".flatness_sigma_m", p.flatness_sigma_m, {1e-4, 1.0}, "m",
            "Sigma of a wall's flatness, in addition to the measured unevenness.");
}

void describe_corner(CornerParameters& p, bus::ParameterTable& table) {
  describe_walls(p, "corner", table);
  table.add("corner.min_extent_m", p.min_extent_m, {0.0, 10.0}, "m",
            "Least vertical extent of the returns on a wall.");
  table.add("corner.min_rings", p.min_rings, {1, 100}, "", "Fewest rings that measure a wall.");
}

void describe_place_scan(PlaceScanParameters& p, bus::ParameterTable& table) {
  table.add("place_scan.period_s", p.period_s, {0.0, 3600.0}, "s",
            "Time from one PLACE_SCAN to the next; 0 = none. Only detectors and verifiers of the "
            "loop closer that compare clouds use them: 0.5 for these.");
  table.add("place_scan.cube_m", p.cube_m, {0.01, 10.0}, "m",
            "Edge of the cubes of which one point each is kept.");
  table.add("place_scan.max_range_m", p.max_range_m, {1.0, 300.0}, "m",
            "Points at a larger horizontal distance are left out.");
  table.add("place_scan.most_points", p.most_points,
            {10, static_cast<int>(model::PlaceScan::kMostPoints)}, "",
            "Most points, evenly spread; each takes 6 bytes for each place of the drive.");
}

}  // namespace

void describe(LandmarkExtractorParameters& parameters, bus::ParameterTable& table) {
  describe_sensor(parameters.planar, table);
  describe_shape(parameters.planar, table);
  describe_selection(parameters.planar, table);
  describe_sweep(parameters.sweep, table);
  describe_trunk_shape(parameters.trunk, table);
  describe_trunk_selection(parameters.trunk, table);
  describe_corner(parameters.corner, table);
  describe_walls(parameters.planar_corner, "planar_corner", table);
  describe_place_scan(parameters.place_scan, table);
}

}  // namespace understory::landmark_extractor
