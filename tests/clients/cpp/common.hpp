// Compiled once for all of the generated files.

#include <boost/json.hpp>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>
