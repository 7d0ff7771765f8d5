#include "services/landmark_extractor/adapter_parameters.hpp"

namespace understory {
namespace {

void describe_sensor(PlanarTrunkParameters& p, ParameterTable& table) {
  table.add("planar.min_range_m", p.min_range_m, {0.0, 100.0}, "m",
            "What is nearer is the vehicle itself.");
  table.add("planar.max_range_m", p.max_range_m, {1.0, 1000.0}, "m",
            "Trunks farther than this are not reported.");
  table.add("planar.range_sigma_m", p.range_sigma_m, {1e-4, 10.0}, "m", "Noise of one beam.");
  table.add("planar.beam_width_rad", p.beam_width_rad, {0.0, 0.1}, "rad",
            "By how much a beam's footprint widens a trunk on each side.");
}

void describe_shape(PlanarTrunkParameters& p, ParameterTable& table) {
  table.add("planar.roundness_sigma_m", p.roundness_sigma_m, {0.0, 1.0}, "m",
            "Of the bark from a circle.");
  table.add("planar.shape_sigma_m", p.shape_sigma_m, {0.0, 1.0}, "m",
            "How far the centre as seen from one side is off.");
  table.add("planar.shape_correlation_scans", p.shape_correlation_scans, {1.0, 1000.0}, "scans",
            "Over how many scans that stays the same.");
  table.add("planar.min_radius_m", p.min_radius_m, {0.001, 10.0}, "m", "Of a trunk.");
  table.add("planar.max_radius_m", p.max_radius_m, {0.01, 10.0}, "m", "Of a trunk.");
  table.add("planar.prior_radius_m", p.prior_radius_m, {0.001, 10.0}, "m",
            "What a trunk's radius is before it is measured.");
  table.add("planar.prior_radius_sigma_m", p.prior_radius_sigma_m, {0.001, 10.0}, "m",
            "Standard deviation of that.");
}

void describe_selection(PlanarTrunkParameters& p, ParameterTable& table) {
  table.add("planar.break_distance_m", p.break_distance_m, {0.01, 10.0}, "m",
            "Neighbouring returns farther apart are two objects.");
  table.add("planar.break_per_range", p.break_per_range, {0.0, 1.0}, "m per m",
            "Added to that for each metre of range.");
  table.add("planar.clearance_m", p.clearance_m, {0.0, 100.0}, "m",
            "What stands beside a trunk must be so much farther away.");
  table.add("planar.separation_m", p.separation_m, {0.0, 100.0}, "m",
            "A trunk's distance to any other object; bushes have less.");
  table.add("planar.line_tolerance_m", p.line_tolerance_m, {0.0, 10.0}, "m",
            "What is so near the line between its neighbours is a wall.");
  table.add("planar.min_points", p.min_points, {1, 1000}, "", "Fewest beams on a trunk.");
  table.add("planar.max_mean_square_residual", p.max_mean_square_residual, {0.1, 1e6}, "sigma^2",
            "Of the ranges from the fitted circle.");
}

}  // namespace

void describe(LandmarkExtractorParameters& parameters, ParameterTable& table) {
  describe_sensor(parameters.planar, table);
  describe_shape(parameters.planar, table);
  describe_selection(parameters.planar, table);
}

}  // namespace understory
