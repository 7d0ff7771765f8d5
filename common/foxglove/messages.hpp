// Single messages of the well-known schemas (foxglove.NAME), as JSON.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/foxglove/frame_links.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/point_sweep.hpp"
#include "common/model/submap.hpp"
#include "understory/gnss_t.hpp"
#include "understory/lidar_scan_t.hpp"
#include "understory/log_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::foxglove {

/// foxglove.PoseInFrame.
std::string pose_in_frame(model::Utime utime, std::string_view frame, const geometry::SE2& pose);
/// foxglove.PosesInFrame.
std::string poses_in_frame(model::Utime utime, std::string_view frame,
                           std::span<const geometry::SE2> poses);
/// foxglove.FrameTransforms, all of one moment.
std::string frame_transforms(model::Utime utime, std::span<const FrameLink> links);
/// foxglove.FrameTransforms: poses of the submaps, as frames submap_N.
std::string frame_transforms(const model::MapCorrection& correction);
/// foxglove.LaserScan, frame vehicle; a range of 0 is no return.
std::string laser_scan(const lidar_scan_t& scan);
/// foxglove.PointCloud, frame vehicle (x, y, z float32 [m], intensity uint8; 13 bytes a point),
/// level where the attitude is known; above `most_points` only every n-th point.
std::string point_cloud(const model::PointSweep& sweep, std::size_t most_points);
/// foxglove.SceneUpdate: the detections of one scan as one entity, frame vehicle.
std::string detections_scene(const model::LandmarkScan& scan);
/// foxglove.SceneUpdate: the landmarks of the world as one entity, frame world.
std::string truth_scene(const truth_landmarks_t& truth);
/// foxglove.Log; `file` is its channel.
std::string log_line(const log_t& line);
/// foxglove.LocationFix of a fix with geodetic coordinates, frame vehicle.
std::string location_fix(const gnss_t& fix);

}  // namespace understory::foxglove
