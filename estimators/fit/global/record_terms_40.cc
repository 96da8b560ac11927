#include "estimators/fit/global/record_terms_impl.h"

namespace imrig::est {

template RecordTerms record_terms_n<40>(const DrivenRecord&, const Whitener&, int,
                                        const SharedVector<double>&, const LocalVector<double>&, const Lanes&,
                                        RecordTrace*);

}  // namespace imrig::est
