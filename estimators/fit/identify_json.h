#pragma once
// JSON text of an identification: {"version":1,"model":{param:{"value","ci95":[low,high],"unit","found"}},
// "records":[{"id","used_for":[..],"rejected":reason|null,"parameters":{..}, ...}],"notes":[..]}; numbers
// that are not known are null.

#include <string>

#include "estimators/fit/identify.h"

namespace imrig::est {

std::string to_json(const IdentifyResult& result);

}  // namespace imrig::est
