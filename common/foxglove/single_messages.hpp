// Messages of the bus that are converted without stored state.
#pragma once

#include "common/foxglove/outbox.hpp"
#include "common/model/ekf_output.hpp"
#include "common/model/imu.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/submap.hpp"
#include "understory/gnss_t.hpp"
#include "understory/health_t.hpp"
#include "understory/lidar_scan_t.hpp"
#include "understory/log_t.hpp"
#include "understory/truth_landmarks_t.hpp"

namespace understory::foxglove {

/// Each function puts out the converted message; false = not fit for display, and nothing is put
/// out.
bool give_message(Outbox& out, const model::MapCorrection& correction);
/// LANDMARKS.
bool give_message(Outbox& out, const model::LandmarkScan& scan);
/// LIDAR_SCAN.
bool give_message(Outbox& out, const lidar_scan_t& scan);
/// RAW_POSE.
bool give_message(Outbox& out, const model::RawPose& pose);
/// TRUTH_LANDMARKS.
bool give_message(Outbox& out, const truth_landmarks_t& truth);
/// GNSS; without a fix there is no output, which is no fault.
bool give_message(Outbox& out, const gnss_t& fix);
/// LOG.
bool give_message(Outbox& out, const log_t& line);
/// HEALTH.
bool give_message(Outbox& out, const health_t& health);
/// LOOP_CLOSURE.
bool give_message(Outbox& out, const model::LoopClosure& closure);
/// LOOP_RESULT.
bool give_message(Outbox& out, const model::LoopResult& result);
/// IMU.
bool give_message(Outbox& out, const model::ImuSample& sample);

}  // namespace understory::foxglove
