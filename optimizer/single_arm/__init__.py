"""The search of one arm by itself: allowed bases are screened, and the best different ones solved."""
