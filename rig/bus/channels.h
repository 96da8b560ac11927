#pragma once
// Channel names without the prefix. Names that end in _CMD move the rig; a player leaves them out.

namespace imrig::channel {

inline constexpr char kSamples[] = "SAMPLES";                 // samples_t, bridge
inline constexpr char kBridgeStatus[] = "BRIDGE_STATUS";      // bridge_status_t, bridge
inline constexpr char kDynoStatus[] = "DYNO_STATUS";          // dyno_status_t, dyno
inline constexpr char kHeartbeat[] = "HEARTBEAT";             // heartbeat_t, every process
inline constexpr char kAck[] = "ACK";                         // ack_t, followers
inline constexpr char kBridgeLease[] = "BRIDGE_LEASE";        // lease_t, bridge
inline constexpr char kDynoLease[] = "DYNO_LEASE";            // lease_t, dyno
inline constexpr char kRecord[] = "RECORD";                   // record_t, campaign
inline constexpr char kEstimate[] = "ESTIMATE";               // estimate_t, estimator
inline constexpr char kMotorEstimate[] = "MOTOR_ESTIMATE";    // motor_estimate_t, estimator
inline constexpr char kCampaignStatus[] = "CAMPAIGN_STATUS";  // campaign_status_t, campaign
inline constexpr char kDataset[] = "DATASET";                 // dataset_t, campaign and import
inline constexpr char kSeries[] = "SERIES";                   // series_t, import
inline constexpr char kPoints[] = "POINTS";                   // points_t, import
inline constexpr char kRemark[] = "REMARK";                   // remark_t, import
inline constexpr char kLeaseCmd[] = "LEASE_CMD";              // lease_cmd_t
inline constexpr char kBridgeCmd[] = "BRIDGE_CMD";            // bridge_cmd_t
inline constexpr char kDynoCmd[] = "DYNO_CMD";                // dyno_cmd_t
inline constexpr char kEstopCmd[] = "ESTOP_CMD";              // estop_cmd_t

}  // namespace imrig::channel
