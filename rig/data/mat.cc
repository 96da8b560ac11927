#include "rig/data/mat.h"

#include <matio.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "rig/base/error.h"
#include "rig/base/file.h"

namespace imrig {

namespace {

constexpr std::size_t kMaxValues = std::size_t{1} << 28;

struct Close {
  void operator()(mat_t* file) const { Mat_Close(file); }
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using File = std::unique_ptr<mat_t, Close>;
using Variable = std::unique_ptr<matvar_t, Close>;

// Number of values if the variable is a real numeric vector, else 0.
std::size_t vector_length(const matvar_t& variable) {
  if (variable.rank != 2 || variable.isComplex != 0 || variable.name == nullptr) return 0;
  if (variable.class_type < MAT_C_DOUBLE || variable.class_type > MAT_C_UINT64) return 0;
  const std::size_t rows = variable.dims[0], columns = variable.dims[1];
  if ((rows != 1 && columns != 1) || rows * columns < 2) return 0;
  return rows * columns;
}

template <class T>
void copy(const matvar_t& variable, std::vector<double>& out) {
  const std::size_t held = variable.nbytes / sizeof(T);  // a damaged file may claim more than it holds
  const auto* values = static_cast<const T*>(variable.data);
  for (std::size_t k = 0; k < std::min(out.size(), held); ++k) out[k] = static_cast<double>(values[k]);
  if (held < out.size()) out.clear();
}

std::vector<double> values_of(const matvar_t& variable, std::size_t length) {
  std::vector<double> out(length);
  if (variable.data == nullptr) return {};
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      copy<double>(variable, out);
      break;
    case MAT_C_SINGLE:
      copy<float>(variable, out);
      break;
    case MAT_C_INT8:
      copy<std::int8_t>(variable, out);
      break;
    case MAT_C_UINT8:
      copy<std::uint8_t>(variable, out);
      break;
    case MAT_C_INT16:
      copy<std::int16_t>(variable, out);
      break;
    case MAT_C_UINT16:
      copy<std::uint16_t>(variable, out);
      break;
    case MAT_C_INT32:
      copy<std::int32_t>(variable, out);
      break;
    case MAT_C_UINT32:
      copy<std::uint32_t>(variable, out);
      break;
    case MAT_C_INT64:
      copy<std::int64_t>(variable, out);
      break;
    default:
      copy<std::uint64_t>(variable, out);
      break;
  }
  return out;
}

void keep(const matvar_t& variable, std::vector<double> values, ColumnTable& table) {
  const std::string name = variable.name;
  if (values.empty())
    throw Error(table.file, "variable \"" + name + "\" cannot be read", "the file is damaged");
  for (const double x : values) {
    if (std::isinf(x))
      throw Error(table.file, "variable \"" + name + "\" holds an infinite value",
                  "use NaN for a missing value");
  }
  if (table.find(name) >= 0)
    throw Error(table.file, "variable \"" + name + "\" is there twice", "names must differ");
  table.names.push_back(name);
  table.columns.push_back(std::move(values));
}

}  // namespace

ColumnTable read_mat(const std::string& path) {
  read_text(path, std::size_t{1} << 31);  // libmatio says only "failed"; this says why
  const File file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) throw Error(path, "is no .mat file", "save it from MATLAB or Octave with save(..., '-v7')");
  ColumnTable table;
  table.file = path;
  std::size_t total = 0;
  while (const Variable info{Mat_VarReadNextInfo(file.get())}) {
    const std::size_t length = vector_length(*info);
    if (length == 0) continue;
    total += length;
    if (length > kMaxValues || total > kMaxValues)
      throw Error(path, "holds more than 2^28 values", "split it");
    if (Mat_VarReadDataAll(file.get(), info.get()) != 0) keep(*info, {}, table);
    keep(*info, values_of(*info, length), table);
  }
  if (table.names.empty())
    throw Error(path, "holds no vector of real numbers", "one variable per column is needed");
  return table;
}

}  // namespace imrig
