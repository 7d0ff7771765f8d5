// Registered clouds of real forest plots, and the sweeps of a spinning LIDAR in them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "sim/spinning_lidar.hpp"

namespace understory::eval::experiments::frontend {

/// One point of a registered cloud.
struct PlotPoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Frame of the plot, z up.
  double height_m = 0.0;                                 ///< Above the ground.
};
/// A stem as others estimated it from the same cloud, at 1.1-1.6 m: indicative, no truth.
struct PlotStem {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double radius_m = 0.0;
};
/// A registered cloud and the list of its stems.
struct ForestPlot {
  std::string name;
  std::vector<PlotPoint> points;
  std::vector<PlotStem> stems;
};

/// NAME_slice_0.2-3.0m_xyzh_f32.bin (little-endian float32 x, y, z, height) and
/// NAME_stems_own_estimate.csv (x_m,y_m,dbh_m,...) of a folder. Throws std::runtime_error.
ForestPlot read_forest_plot(const std::filesystem::path& folder, const std::string& name);

/// The ground below a plot's points: mean per cell, smooth between; level on beyond them.
class PlotGround {
 public:
  /// `cell_m`: side of the cells over which heights are averaged.
  explicit PlotGround(std::span<const PlotPoint> points, double cell_m = 1.0);
  /// Height of the ground, frame of the plot [m].
  double height_m(const Eigen::Vector2d& place_m) const;

 private:
  double& at(int column, int row);
  double clamped(int column, int row) const;
  void fill_gaps(const std::vector<int>& counts);

  double cell_m_;
  Eigen::Vector2d low_m_ = Eigen::Vector2d::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<double> heights_m_;
};

/// How well a cloud shows a stem to a station: beams that should meet its middle between knee
/// height and above a person's, nothing before it, and those of them that the cloud gives a return.
struct StemObservation {
  std::uint32_t beams = 0;
  std::uint32_t returns = 0;
  /// Whether the cloud has points on all of the side that faces the station: elsewhere a surface
  /// ends where the scan of the plot ended, which is no edge of the stem.
  bool is_whole = false;
};
/// A sweep and what of each stem it could show.
struct PlotSweep {
  model::PointSweep sweep;
  std::vector<StemObservation> stems;  ///< As many as the plot has.
};

/// Makes sweeps out of a cloud. A beam returns the surface between the points to its left and to
/// its right, where both are near it and at about the same range; the nearest such surface hides
/// the others. A single point returns the beam that meets it. Clouds show some stems from one
/// side only: what is listed as a stem is opaque, so that its far side is never visible from
/// within.
class PlotScanner {
 public:
  /// The laser, and how a cloud becomes a surface.
  struct Parameters {
    std::vector<double> elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp32);
    int columns = 1800;
    double sensor_height_m = 1.9;
    /// Points so far to the side of a beam, above or below it, are still its neighbours; more
    /// where the cloud is thin (distance to the fourth neighbour).
    double least_reach_m = 0.05;
    double most_reach_m = 0.12;
    double depth_m = 0.1;  ///< Neighbours farther apart in range are two surfaces.
    double range_sigma_m = 0.02;
    double min_range_m = 0.8;
    double max_range_m = 40.0;
  };
  /// `plot` must outlive the scanner.
  PlotScanner(const ForestPlot& plot, Parameters parameters);

  /// A sweep as LIDAR_SWEEP of a level, stationary vehicle at `station_m`; its origin is there on
  /// the ground, its axes are the plot's.
  PlotSweep sweep(const Eigen::Vector2d& station_m, std::mt19937_64& random) const;
  /// The ground below the plot.
  const PlotGround& ground() const { return ground_; }

 private:
  struct Return {
    double azimuth_rad = 0.0;
    double elevation_rad = 0.0;
    double range_m = 0.0;
    double reach_m = 0.0;
  };
  /// Where a bearing meets the middle of a stem; `level_m` infinite = none.
  struct Meeting {
    double level_m = std::numeric_limits<double>::infinity();
    std::size_t stem = 0;
  };
  void measure_reach();
  void look_around_stems();
  bool is_whole(std::size_t stem, const Eigen::Vector2d& station_m) const;
  Meeting meeting(const Eigen::Vector2d& station_m, double azimuth_rad) const;
  std::vector<Return> returns_at(const Eigen::Vector3d& sensor_m) const;
  /// Range of each column of a beam; infinite = no return.
  std::vector<double> ring(std::span<const Return> returns, double elevation_rad) const;
  double surface(std::span<const Return* const> near_beam, double azimuth_rad) const;
  double ground_range(const Eigen::Vector3d& sensor_m, double azimuth_rad,
                      double elevation_rad) const;
  double azimuth_of(int column) const;

  const ForestPlot& plot_;
  Parameters parameters_;
  PlotGround ground_;
  std::vector<double> reach_m_;  ///< Of each point.
  static constexpr int kSectors = 36;
  std::vector<std::array<int, kSectors>> around_;  ///< Points of each stem by their bearing.
};

}  // namespace understory::eval::experiments::frontend
