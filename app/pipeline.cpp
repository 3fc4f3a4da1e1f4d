#include "app/pipeline.h"
