// The landmark extractor in a real forest plot, from many stations, against estimates of its stems.
#pragma once

#include <cstdint>
#include <vector>

#include "eval/experiments/frontend/forest_plot.hpp"
#include "services/landmark_extractor/landmark_extractor.hpp"

namespace understory::eval::experiments::frontend {

/// Where stations are, and which stems must be found from them.
struct PlotScoreOptions {
  PlotScanner::Parameters scanner;
  double grid_m = 1.5;              ///< Between stations...
  double clearance_m = 0.6;         ///< ... where nothing lower than a vehicle is so near.
  double recall_range_m = 25.0;     ///< A stem within it...
  std::uint32_t least_returns = 5;  ///< ... with so many returns ...
  double least_share = 0.95;        ///< ... from this part of its beams must be found.
  double match_m = 0.5;
  std::uint64_t seed = 1;
};

/// A detection in the frame of the plot.
struct PlotDetection {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();  ///< In the plan.
  double radius_m = 0.0;
  int stem = -1;          ///< Index of its stem; -1 = none.
  bool is_whole = false;  ///< Whether the cloud shows all of the side that faces the station.
};

/// How far detections are from the list of stems, and from each other.
struct PlotErrors {
  std::uint64_t detections = 0;
  double difference_m = 0.0;   ///< RMS in the plan between a detection and its stem.
  double radius_bias_m = 0.0;  ///< Mean of detected less estimated radii.
  double spread_m = 0.0;       ///< RMS of the detections of a stem about their own mean.
  /// Mean of the same, squared and weighted by the detections' covariances; 2 is exact. The
  /// position in the list has no influence on it.
  double nees = 0.0;
};

/// What the extractor found in a plot, over all stations.
struct PlotScore {
  std::vector<Eigen::Vector2d> stations_m;
  double points = 0.0;  ///< Mean per sweep.
  std::uint64_t should = 0;
  std::uint64_t found = 0;
  std::vector<PlotDetection> detections;  ///< Of all stations.
  std::vector<std::uint32_t> should_of_stem;
  std::vector<std::uint32_t> found_of_stem;
  std::uint64_t corners = 0;                         ///< There are none: each is false.
  landmark_extractor::trunks::TrunkCounters trunks;  ///< Why columns of returns were refused.
  PlotErrors all;
  PlotErrors whole;  ///< Of stems on whose near side the cloud has no gap.

  /// Share of the stems that had to be found; 1 where there are none.
  double recall() const { return should > 0 ? static_cast<double>(found) / should : 1.0; }
  /// Share of the detections that are a listed stem; 1 where there are none.
  double precision() const;
};

/// Places on a grid in the plot where a vehicle has room [m], frame of the plot.
std::vector<Eigen::Vector2d> plot_stations(const ForestPlot& plot, const PlotScoreOptions& options);

/// Runs the extractor on one sweep from every station. Everything follows from `options.seed`.
PlotScore score_plot(const ForestPlot& plot,
                     const landmark_extractor::LandmarkExtractorParameters& parameters,
                     const PlotScoreOptions& options);

}  // namespace understory::eval::experiments::frontend
