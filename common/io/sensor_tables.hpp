// IMU and GNSS as tables of text (CSV) with a heading.
#pragma once

#include <string_view>
#include <vector>

#include "common/model/gnss.hpp"
#include "common/model/imu.hpp"
#include "common/model/wheels.hpp"

namespace understory::io {

/// Columns by name, in any order: t_s (or t_us, t_ns), gx gy gz (rad/s), ax ay az (m/s^2).
/// Throws DataError with file, line and column, also for a value beyond 1e9.
std::vector<model::ImuSample> parse_imu_table(std::string_view text, std::string_view source);
/// t_s, and latitude_deg longitude_deg or east_m north_m; optional: sigma_m, ve_mps vn_mps,
/// velocity_sigma_mps. The first fix is the origin of latitudes. Throws DataError.
std::vector<model::GnssFix> parse_gnss_table(std::string_view text, std::string_view source);
/// t_s, speed_mps; optional: steering_rad. Throws DataError.
std::vector<model::WheelSample> parse_wheel_table(std::string_view text, std::string_view source);

}  // namespace understory::io
