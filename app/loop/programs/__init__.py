"""Program text: what is in the machines' programs made into characteristics, and characteristics and corrections written for them."""
